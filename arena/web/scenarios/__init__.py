"""Pages of scenes, scenarios and what they ask for."""
