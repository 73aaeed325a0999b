"""Casting votes, and choosing the pictures that a study shows."""
