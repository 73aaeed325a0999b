"""Whether an expert who sees a pair a second time, sides swapped, says the same.

Notation: R pairs of a vote and its repeat; scores are those of the same contestant both times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arena.rating.comparisons import FloatArray, IntArray
from arena.rating.estimate import Estimate
from arena.rating.shares import share


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeats:
    """Test and re-test.

    Attributes:
        same: The share of repeats with the same outcome, its interval clustered by expert.
        reversed: The share in which the winner became the loser.
        by_expert: The number of repeats and of equal ones, by expert.
    """

    number: int
    same: Estimate
    reversed: Estimate
    by_expert: dict[int, tuple[int, int]]


def repeat_consistency(first: FloatArray, again: FloatArray, expert: IntArray) -> Repeats:
    """Compare judgements of the same pictures by the same expert.

    Args:
        first: (R,) what a contestant scored the first time: 1, 0.5 or 0.
        again: (R,) what the same contestant scored the second time.
        expert: (R,) whose judgements they are.

    Raises:
        ValueError: The three have different lengths.
    """
    if not len(first) == len(again) == len(expert):
        raise ValueError(f"{len(first)} votes, {len(again)} repeats, {len(expert)} experts")
    same = first == again
    return Repeats(
        number=len(first),
        same=share(same, expert),
        reversed=share(np.abs(first - again) == 1.0, expert),
        by_expert={
            who: (int((expert == who).sum()), int(same[expert == who].sum()))
            for who in np.unique(expert).tolist()
        },
    )
