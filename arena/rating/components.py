"""Resampled rounds that do not determine everybody: who is rated in them, above and below whom.

Between contestants who scored against each other through chains both ways the difference is
finite (Ford 1957). Where only one of two did, it grows without limit in the known direction;
where neither did, nothing is known. So a round rates those of its largest component among each
other and puts the others above it, below it or nowhere.

Notation: C contestants, P pairs, N rounds, which are the last axis unless said otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import BoolArray, FloatArray
from arena.rating.estimate import LEVEL

MOST_DEGENERATE = (1.0 - LEVEL) / 2.0
"""The largest share of rounds without somebody that still leaves both percentiles to read."""

SideArray = NDArray[np.int8]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loose:
    """Rounds that leave some differences without a limit.

    Attributes:
        values: (C, N) ratings; only those of one component can be compared, NaN is unknown.
        in_main: (C, N) who is in the round's largest component; nobody where all are single.
        side: (C, N) 1 above that component, -1 below it, 0 unknown or in it.
        side_of_all: (C, N) 1 where somebody is at least level with everybody and above some,
            -1 for the opposite, else 0.
    """

    values: FloatArray
    in_main: BoolArray
    side: SideArray
    side_of_all: SideArray

    @classmethod
    def none(cls, contestants: int) -> Self:
        """No such rounds."""
        sides = np.empty((contestants, 0), dtype=np.int8)
        return cls(
            values=np.empty((contestants, 0)),
            in_main=np.empty((contestants, 0), dtype=bool),
            side=sides,
            side_of_all=sides,
        )

    @classmethod
    def joined(cls, some: list[Self]) -> Self:
        """All of them, one after the other."""
        return cls(
            values=np.hstack([one.values for one in some]),
            in_main=np.hstack([one.in_main for one in some]),
            side=np.hstack([one.side for one in some]),
            side_of_all=np.hstack([one.side_of_all for one in some]),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """Ratings of all rounds, those without a limit included.

    Attributes:
        values: (C, B) points; plus or minus infinity where only the direction is known, NaN
            where nothing is.
        reference: (C,) those whose mean the values are relative to: everybody whom nearly every
            round determines.
    """

    values: FloatArray
    reference: BoolArray

    @property
    def are_finite(self) -> bool:
        """Whether every round determines everybody."""
        return bool(np.isfinite(self.values).all())


def loose(reached: BoolArray, values: FloatArray, *, votes: FloatArray) -> Loose:
    """Who is rated, above and below whom in rounds that do not determine everybody.

    Args:
        reached: (N, C, C) whether the row's contestant scored against the column's through a
            chain.
        values: (C, N) ratings fitted within the components; NaN where there are none.
        votes: (C,) of the data; of components of one size the one with whoever has the most votes
            is the main one.
    """
    mutual = reached & reached.transpose(0, 2, 1)
    size = mutual.sum(axis=2)
    by_votes = np.argsort(-votes, kind="stable")
    leader = by_votes[np.argmax(size[:, by_votes], axis=1)]
    every = np.arange(len(reached))
    in_main = mutual[every, leader] & (size[every, leader] > 1)[:, None] & ~np.isnan(values.T)
    above, below = reached[every, :, leader], reached[every, leader, :]
    side = np.where(in_main, 0, above.astype(np.int8) - below.astype(np.int8))
    side[~in_main.any(axis=1)] = 0
    over_all, under_all = reached.all(axis=2), reached.all(axis=1)
    return Loose(
        values=values,
        in_main=in_main.T,
        side=np.asarray(side.T, dtype=np.int8),
        side_of_all=np.asarray(1 * over_all - 1 * under_all, dtype=np.int8).T,
    )


def place_on_one_scale(rating: FloatArray, samples: FloatArray, rounds: Loose) -> Placed:
    """Put all rounds on one scale: there the mean of the reference stays that of the data.

    Whoever is missing from the largest component in more than a 40th of the rounds is not part of
    the reference, so that a contestant with hardly any votes does not move the others.

    Args:
        rating: (C,) of the data.
        samples: (C, b) of the rounds that determine everybody.
        rounds: The others.
    """
    everywhere, apart = samples.shape[1], rounds.values.shape[1]
    missing = (~rounds.in_main).sum(axis=1)
    reference = missing <= MOST_DEGENERATE * (everywhere + apart)
    if reference.sum() < 2:
        reference = np.ones(len(rating), dtype=bool)
    if not reference.all():
        samples = samples + (rating[reference].mean() - samples[reference].mean(axis=0))
    if not apart:
        return Placed(values=samples, reference=reference)
    joined = rounds.in_main & reference[:, None]
    number = joined.sum(axis=0)
    gap = np.where(joined, rating[:, None] - rounds.values, 0.0).sum(axis=0)
    shift = gap / np.maximum(number, 1)
    side = np.where(number > 1, rounds.side, rounds.side_of_all)
    values = np.where(rounds.in_main & (number > 1), rounds.values + shift, np.nan)
    values[side > 0], values[side < 0] = np.inf, -np.inf
    return Placed(values=np.hstack([samples, values]), reference=reference)


def open_interval(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The percentile interval (C,), (C,) of values (C, B); a bound that is not finite is NaN.

    Unknown values count as the worst on each side: a bound is finite only if it is whatever they
    were.
    """
    tail = (1.0 - LEVEL) / 2.0
    unknown = np.isnan(values)
    lower = _quantile(np.where(unknown, -np.inf, values), tail)
    upper = _quantile(np.where(unknown, np.inf, values), 1.0 - tail)
    return lower, upper


def _quantile(values: FloatArray, share: float) -> FloatArray:
    """(C,) as numpy interpolates it; NaN where one of the two neighbours is infinite."""
    place = (values.shape[1] - 1) * share
    first, last = int(np.floor(place)), int(np.ceil(place))
    ordered = np.partition(values, [first, last], axis=1)
    low, high = ordered[:, first], ordered[:, last]
    finite = np.isfinite(low) & np.isfinite(high)
    with np.errstate(invalid="ignore"):
        return np.where(finite, low + (high - low) * (place - first), np.nan)
