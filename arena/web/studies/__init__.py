"""Pages of a study from its plan to its files."""
