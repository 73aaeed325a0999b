"""The letters of the wire: which side an expert sees as A and which as B."""

from __future__ import annotations

LETTERS = {"left": "A", "equal": "E", "right": "B", "skip": "skip"}
OUTCOMES = {letter: outcome for outcome, letter in LETTERS.items()}
