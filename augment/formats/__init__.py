"""One file a format: readers give a Scene, writers take a Modification."""
