"""Scenes and scenarios: read, written, edited, removed."""
