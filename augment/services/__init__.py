"""Writes of augment, one subject a file: keyword-only functions that return rows."""
