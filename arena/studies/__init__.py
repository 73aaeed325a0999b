"""Studies: planned, opened, closed."""
