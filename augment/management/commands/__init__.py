"""One command a file; each is a door to a service."""
