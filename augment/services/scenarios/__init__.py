"""Scenes, scenarios and the catalogue as rows, and their pictures."""
