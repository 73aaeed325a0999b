"""Reads of arena, one subject a file; who may see what is decided here."""
