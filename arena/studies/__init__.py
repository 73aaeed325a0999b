"""Studies: set up, opened, planned on, handed over and closed."""
