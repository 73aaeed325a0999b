"""Ratings and studies as tables, charts and files."""
