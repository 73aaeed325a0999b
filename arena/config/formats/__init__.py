"""Formats of dates and numbers: the day before the month, and numbers as in the paper's tables."""
