"""Votes of a rating: which count, lists of them, and what they say of the pictures."""
