"""Home, health and the log of acts."""
