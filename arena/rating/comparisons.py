"""Votes as arrays, and counted by pair.

Notation: V votes, C contestants, P pairs that met, B bootstrap rounds. Contestants, experts and
scenarios are integers from 0; `names` gives the contestants' names.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

WIN, TIE, LOSS = 1.0, 0.5, 0.0
"""What the first contestant of a comparison scores."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One vote: what `first` scored against `second`, who judged, and on which scenario."""

    first: str
    second: str
    score: float
    expert: str = ""
    scenario: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparisons:
    """All votes; every array is (V,) and read-only.

    Attributes:
        names: (C,) of the contestants.
        first, second: Who was compared.
        score: What `first` scored: 1, 0.5 or 0.
        expert, scenario: Whose vote it is, and on what.
    """

    names: tuple[str, ...]
    first: IntArray
    second: IntArray
    score: FloatArray
    expert: IntArray
    scenario: IntArray

    def __post_init__(self) -> None:
        for field in fields(self)[1:]:
            getattr(self, field.name).flags.writeable = False

    def __len__(self) -> int:
        return len(self.score)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairCounts:
    """Votes counted by pair, the pairs in order and `low` < `high`.

    Attributes:
        low, high: (P,) contestants.
        outcomes: (P, 3) how often low won, neither, high won.
        pair_of: (V,) the pair of each vote.
        outcome_of: (V,) 0 where low won, 1 for a tie, 2 where high won.
    """

    low: IntArray
    high: IntArray
    outcomes: IntArray
    pair_of: IntArray
    outcome_of: IntArray

    @property
    def games(self) -> FloatArray:
        """(P,) comparisons of each pair."""
        return np.asarray(self.outcomes.sum(axis=1), dtype=np.float64)

    @property
    def scores(self) -> FloatArray:
        """(P,) what low scored; a tie is half a win."""
        return np.asarray(self.outcomes[:, 0] + 0.5 * self.outcomes[:, 1])


def as_arrays(names: Sequence[str], votes: Iterable[Comparison]) -> Comparisons:
    """Number the names and put the votes into arrays, in the given order.

    Args:
        names: Every contestant, also those without votes.
        votes: One entry a vote.

    Raises:
        ValueError: A name is not in `names` or there twice, a contestant meets itself, or a score
            is none of 1, 0.5 and 0; the text has the number of the vote.
    """
    number = {name: index for index, name in enumerate(names)}
    if len(number) < len(names):
        raise ValueError("a contestant is named twice")
    experts: dict[str, int] = {}
    scenarios: dict[str, int] = {}
    rows = []
    for count, vote in enumerate(votes, start=1):
        for name in (vote.first, vote.second):
            if name not in number:
                raise ValueError(f"vote {count}: {name!r} is none of {', '.join(names)}")
        if vote.first == vote.second:
            raise ValueError(f"vote {count}: {vote.first!r} is compared with itself")
        if vote.score not in (WIN, TIE, LOSS):
            raise ValueError(f"vote {count}: a score is 1, 0.5 or 0, not {vote.score!r}")
        rows.append(
            (
                number[vote.first],
                number[vote.second],
                experts.setdefault(vote.expert, len(experts)),
                scenarios.setdefault(vote.scenario, len(scenarios)),
                vote.score,
            )
        )
    table = np.array(rows, dtype=np.float64).reshape(-1, 5)
    first, second, expert, scenario = table[:, :4].T.astype(np.int64)
    return Comparisons(
        names=tuple(names),
        first=first,
        second=second,
        expert=expert,
        scenario=scenario,
        score=table[:, 4].copy(),
    )


def count_pairs(votes: Comparisons) -> PairCounts:
    """Count wins, ties and losses of every pair that met."""
    contestants = len(votes.names)
    low = np.minimum(votes.first, votes.second)
    high = np.maximum(votes.first, votes.second)
    code, pair_of = np.unique(low * contestants + high, return_inverse=True)
    score_of_low = np.where(votes.first == low, votes.score, 1.0 - votes.score)
    outcome_of = np.rint(2.0 * (1.0 - score_of_low)).astype(np.int64)
    counted = np.bincount(pair_of * 3 + outcome_of, minlength=3 * len(code))
    return PairCounts(
        low=code // max(contestants, 1),
        high=code % max(contestants, 1),
        outcomes=counted.reshape(-1, 3).astype(np.int64),
        pair_of=pair_of,
        outcome_of=outcome_of,
    )


def tally(votes: Comparisons) -> IntArray:
    """(C, 3) wins, ties and losses of each contestant."""
    contestants = len(votes.names)
    counts = np.zeros((contestants, 3), dtype=np.int64)
    outcome = np.rint(2.0 * (1.0 - votes.score)).astype(np.int64)
    np.add.at(counts, (votes.first, outcome), 1)
    np.add.at(counts, (votes.second, 2 - outcome), 1)
    return counts
