"""Votes that count, readers of results, and the evidence behind a number."""
