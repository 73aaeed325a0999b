"""Pages of a voter."""
