"""Command line of augment."""
