"""Writes of arena, one subject a file: keyword-only functions that return rows."""
