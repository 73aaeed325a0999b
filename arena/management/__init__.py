"""Command line of arena."""
