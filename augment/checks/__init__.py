"""Geometric findings about a modification, as values with numbers."""
