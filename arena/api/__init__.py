"""The wire: REST, one resource a file."""
