"""Checks of a modification that need no intent."""
