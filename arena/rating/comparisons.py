"""Votes as arrays, and counted by pair.

Votes that agree in everything may stand in one row with their number.

Notation: R rows, C contestants, P pairs that met. Contestants, experts and scenarios are integers
from 0; `names` gives the contestants' names.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri, stdtr, stdtrit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

WIN, TIE, LOSS = 1.0, 0.5, 0.0
"""What the first contestant of a comparison scores."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparisons:
    """All votes; every array is (R,) and read-only.

    A row is one vote, or `count` votes of one expert on one scenario, pair, side and outcome: what
    a GROUP BY of these gives. The order of the rows does not matter.

    Attributes:
        names: (C,) of the contestants.
        shown: (C,) what remarks call them; by default their names.
        first, second: Who was compared; `first` was shown on the left.
        score: What `first` scored: 1, 0.5 or 0.
        expert, scenario: Whose vote it is, and on what.
        count: How many votes the row stands for, at least 1; by default each for one.
    """

    names: tuple[str, ...]
    first: IntArray
    second: IntArray
    score: FloatArray
    expert: IntArray
    scenario: IntArray
    count: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    shown: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.score) and not len(self.count):
            object.__setattr__(self, "count", np.ones(len(self.score), dtype=np.int64))
        if not self.shown:
            object.__setattr__(self, "shown", self.names)
        for name in _array_names():
            getattr(self, name).flags.writeable = False

    def __len__(self) -> int:
        """Rows, not votes."""
        return len(self.score)

    @property
    def votes(self) -> int:
        """Number of votes."""
        return int(self.count.sum())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairCounts:
    """Votes counted by pair, the pairs in order and `low` < `high`.

    Attributes:
        low, high: (P,) contestants.
        outcomes: (P, 3) how often low won, neither, high won.
        pair_of: (R,) the pair of each row.
        outcome_of: (R,) 0 where low won, 1 for a tie, 2 where high won.
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


def _array_names() -> list[str]:
    return [column.name for column in fields(Comparisons) if column.name not in ("names", "shown")]


def select_votes(votes: Comparisons, rows: BoolArray | IntArray) -> Comparisons:
    """Some of the rows, of the same contestants."""
    return replace(votes, **{name: getattr(votes, name)[rows] for name in _array_names()})


def restrict_to(votes: Comparisons, members: Sequence[int]) -> Comparisons:
    """The votes in which only these contestants met, numbered anew in the given order."""
    if list(members) == list(range(len(votes.names))):
        return votes
    number = np.full(len(votes.names), -1, dtype=np.int64)
    number[list(members)] = np.arange(len(members))
    inside = select_votes(votes, (number[votes.first] >= 0) & (number[votes.second] >= 0))
    return replace(
        inside,
        names=tuple(votes.names[member] for member in members),
        shown=tuple(votes.shown[member] for member in members),
        first=number[inside.first],
        second=number[inside.second],
    )


def count_pairs(votes: Comparisons) -> PairCounts:
    """Count wins, ties and losses of every pair that met."""
    contestants = len(votes.names)
    low, high = np.minimum(votes.first, votes.second), np.maximum(votes.first, votes.second)
    # (R,) one number a pair; counting and a running sum number those that met, without a sort.
    pair = low * contestants + high
    has_met = np.bincount(pair, minlength=1) > 0
    met, pair_of = np.flatnonzero(has_met), (np.cumsum(has_met) - 1)[pair]
    # Scores 1, 1/2, 0 of `first` become 0, 1, 2, turned round where `first` is the high one.
    outcome_of = (2.0 - 2.0 * votes.score).astype(np.int64)
    outcome_of = np.where(votes.first == low, outcome_of, 2 - outcome_of)
    place = pair_of * 3 + outcome_of
    counted = np.bincount(place, weights=votes.count, minlength=3 * len(met))
    return PairCounts(
        low=met // max(contestants, 1),
        high=met % max(contestants, 1),
        outcomes=counted.reshape(-1, 3).astype(np.int64),
        pair_of=pair_of,
        outcome_of=outcome_of,
    )


def tally(votes: Comparisons) -> IntArray:
    """(C, 3) wins, ties and losses of each contestant."""
    size = 3 * len(votes.names)
    outcome = (2.0 - 2.0 * votes.score).astype(np.int64)
    counted = np.bincount(votes.first * 3 + outcome, weights=votes.count, minlength=size)
    counted += np.bincount(votes.second * 3 + 2 - outcome, weights=votes.count, minlength=size)
    return counted.reshape(-1, 3).astype(np.int64)


def count_codes(codes: IntArray) -> int:
    """Count how many different contestants, experts or scenarios occur."""
    return int(np.count_nonzero(np.bincount(codes)))


def count_wins(votes: Comparisons) -> tuple[IntArray, IntArray]:
    """(C, C) how often the row's contestant beat the column's, and (C, C) their ties."""
    counts = count_pairs(votes)
    wins, ties = np.zeros((2, len(votes.names), len(votes.names)), dtype=np.int64)
    wins[counts.low, counts.high] = counts.outcomes[:, 0]
    wins[counts.high, counts.low] = counts.outcomes[:, 2]
    ties[counts.low, counts.high] = ties[counts.high, counts.low] = counts.outcomes[:, 1]
    return wins, ties


# --- Numbers with intervals ----------------------------------------------------------------------


LEVEL = 0.95
"""Of every interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A number with its 95 % interval; None where the votes do not determine it."""

    value: float | None
    lower: float | None = None
    upper: float | None = None


# --- Student's t ---------------------------------------------------------------------------------


def t_above(value: ArrayLike, degrees: ArrayLike) -> FloatArray:
    """Return the probability that t is above a value that is not negative."""
    return np.asarray(stdtr(np.maximum(degrees, 1.0), -np.asarray(value)))


def t_quantile(degrees: ArrayLike, probability: float = 0.5 + LEVEL / 2.0) -> FloatArray:
    """Return the quantile of Student's t for a probability above a half."""
    return np.asarray(stdtrit(np.maximum(degrees, 1.0), probability))


# --- Shares of votes -----------------------------------------------------------------------------


def share(hits: BoolArray, clusters: IntArray) -> Estimate:
    """The share of hits with a 95 % interval.

    With two clusters or more the spread between clusters counts (a linear sandwich, t quantile);
    with one, or where clusters do not differ at all, it is Wilson's interval for single votes.

    Args:
        hits: (V,) whether each vote is one.
        clusters: (V,) whose vote it is.
    """
    n = len(hits)
    if not n:
        return Estimate(value=None)
    value = float(hits.mean())
    names, cluster = np.unique(clusters, return_inverse=True)
    # (G,) hits above what is expected; their squares by G / (G - 1), over n^2.
    surplus = np.bincount(cluster, weights=hits - value, minlength=len(names))
    groups = len(names)
    spread = math.sqrt(float((surplus**2).sum()) * groups / max(groups - 1, 1)) / n
    if groups < 2 or spread == 0.0:
        return wilson(int(hits.sum()), n)
    half = float(t_quantile(groups - 1)) * spread
    return Estimate(value=value, lower=max(value - half, 0.0), upper=min(value + half, 1.0))


def wilson(hits: int, n: int) -> Estimate:
    """Wilson's 95 % interval of `hits` of `n` independent votes."""
    z = float(ndtri(0.5 + LEVEL / 2))
    value = hits / n
    middle = (value + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(value * (1 - value) / n + z * z / (4 * n * n))
    return Estimate(value=value, lower=max(middle - half, 0.0), upper=min(middle + half, 1.0))
