"""Pages of scenes and scenarios."""
