"""Lines of scenario types whose own votes set no two bounds, with the pooled interval instead."""

from __future__ import annotations

from dataclasses import replace

from arena.results.tree import TypeStanding
from augment.sentences import sentence

POOLED = sentence("pooled with the other types")
"""Stands instead of the note of a line whose own votes set no two bounds."""


def with_pooled(line: TypeStanding) -> TypeStanding:
    """The line; where its own votes leave the interval open, the pooled one, and a note."""
    pooled = line.pooled
    if pooled.value is None or (line.lower is not None and line.upper is not None):
        return line
    return replace(
        line, rating=pooled.value, lower=pooled.lower, upper=pooled.upper, rank=None, note=POOLED
    )
