"""One command a file; each is an entry point of a service."""
