"""Pages of a rating."""
