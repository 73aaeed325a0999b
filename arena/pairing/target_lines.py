"""Targets as people write them: a line for each contestant, or for each pair."""

from __future__ import annotations

import re
from collections.abc import Iterable

from arena.errors import NothingToPlan

_OF_ONE = re.compile(r"([a-z0-9-]+)\s*[=:\s]\s*(\d+)")
_OF_TWO = re.compile(r"([a-z0-9-]+)\s+(?:vs\.?|against)\s+([a-z0-9-]+)\s*[=:\s]\s*(\d+)")

Appearances = tuple[tuple[str, int], ...]
PairVotes = tuple[tuple[str, str, int], ...]


def read_targets(lines: Iterable[str]) -> tuple[Appearances, PairVotes]:
    """What lines like "interplan 1960" or "interplan vs gpt-4o-otm 330" say; empty ones nothing.

    Raises:
        NothingToPlan: A line says neither.
    """
    of_one, of_two = [], []
    for line in lines:
        text = line.strip()
        if not text:
            continue
        if match := _OF_TWO.fullmatch(text):
            of_two.append((match[1], match[2], int(match[3])))
        elif match := _OF_ONE.fullmatch(text):
            of_one.append((match[1], int(match[2])))
        else:
            raise NothingToPlan(
                f"'{text}' is no target: write CONTESTANT NUMBER, or CONTESTANT vs "
                "CONTESTANT NUMBER."
            )
    return tuple(of_one), tuple(of_two)
