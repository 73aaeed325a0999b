"""Who can be told apart from whom: the paper's rank, rank sets, and all pairs at once.

Notation: C contestants, B rounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from arena.rating.comparisons import BoolArray, FloatArray, IntArray
from arena.rating.estimate import LEVEL

_NUMBERS_AT_ONCE = 2_000_000


def ranks(lower: ArrayLike, upper: ArrayLike) -> IntArray:
    """One plus the number of others whose lower bound is above this one's upper bound.

    Args:
        lower: (C,) bounds; minus infinity where there is none.
        upper: (C,) bounds; infinity where there is none.

    Returns:
        (C,) ranks from 1; those who can't be told apart share one.
    """
    lowest_first = np.sort(np.asarray(lower, dtype=float))
    not_above = np.searchsorted(lowest_first, np.asarray(upper, dtype=float), side="right")
    return np.asarray(1 + len(lowest_first) - not_above, dtype=np.int64)


def shown_ranks(lower: FloatArray, upper: FloatArray, *, average: float) -> IntArray:
    """Ranks by the bounds that there are; 0 where these do not decide one.

    Nobody is first for want of bounds. Without an upper bound the first rank takes a lower bound
    above the average, without a lower one it is withheld; all other ranks rest on somebody's
    lower bound above the own upper one.

    Args:
        lower: (C,) bounds, NaN where there is none.
        upper: (C,) bounds, NaN where there is none.
        average: The rating of an average contestant.
    """
    no_lower, no_upper = np.isnan(lower), np.isnan(upper)
    found = ranks(np.where(no_lower, -np.inf, lower), np.where(no_upper, np.inf, upper))
    is_above = ~no_lower & (np.where(no_lower, -np.inf, lower) > average)
    decided = (found > 1) | ~(no_lower | no_upper) | (no_upper & is_above)
    return np.where(decided, found, 0)


def rank_sets(above: BoolArray) -> tuple[IntArray, IntArray]:
    """(C,), (C,): between which places each contestant's true place lies, all of them at once.

    Behind everybody who is shown to be above, ahead of everybody who is shown to be below
    (Mogstad, Romano, Shaikh, Wilhelm 2024). If no pair is wrongly told apart, all are right.

    Args:
        above: (C, C) whether the row's contestant is shown to be above the column's.
    """
    best = 1 + above.sum(axis=0)
    worst = len(above) - above.sum(axis=1)
    return best.astype(np.int64), worst.astype(np.int64)


def above_by_bounds(above: BoolArray, lower: FloatArray, upper: FloatArray) -> BoolArray:
    """(C, C): who is above whom, also among those whose pairs were not judged at once.

    Args:
        above: (C, C) of those who were.
        lower: (C,) bounds, NaN where there is none.
        upper: (C,) bounds, NaN where there is none.
    """
    missing = np.isnan(lower) | np.isnan(upper)
    with np.errstate(invalid="ignore"):
        apart = lower[:, None] > upper[None, :]
    return np.asarray(above | (apart & (missing[:, None] | missing[None, :])))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Separation:
    """Which pairs differ, all pairs judged at once: the error is 5 % for the whole table.

    Attributes:
        above: (C, C) whether the row's contestant is above the column's, by the largest of all
            standardised differences over the rounds (max-t).
        p_value: (C, C) adjusted by max-t, symmetric; 1 on the diagonal.
        holm: (C, C) adjusted by Holm's step-down of the pairs' normal p-values, symmetric.
        critical: How many standard errors a difference must have under max-t.
        difference: (C, C) the row's rating minus the column's.
        error: (C, C) standard error of the difference over the rounds.
        half: (C, C) half the width of the difference's own 95 % interval.
    """

    above: BoolArray
    p_value: FloatArray
    holm: FloatArray
    critical: float
    difference: FloatArray
    error: FloatArray
    half: FloatArray

    def among(self, members: IntArray, contestants: int) -> Self:
        """The same with rows for all: these members' stay, the others differ from nobody."""
        if len(members) == contestants:
            return self
        places = np.ix_(members, members)

        def wide(matrix: FloatArray) -> FloatArray:
            square = np.full((contestants, contestants), np.nan)
            square[places] = matrix
            return square

        above = np.zeros((contestants, contestants), dtype=bool)
        above[places] = self.above
        return replace(
            self,
            above=above,
            p_value=wide(self.p_value),
            holm=wide(self.holm),
            difference=wide(self.difference),
            error=wide(self.error),
            half=wide(self.half),
        )


def separation(rating: FloatArray, samples: FloatArray) -> Separation:
    """Judge all pairs at once, from ratings (C,) and those of the rounds (C, B)."""
    contestants = len(rating)
    low, high = np.triu_indices(contestants, 1)
    covariance: FloatArray = np.atleast_2d(np.cov(samples)).astype(np.float64)
    variance = covariance.diagonal()
    spread = variance[low] + variance[high] - 2.0 * covariance[low, high]
    error = np.asarray(np.sqrt(np.maximum(spread, 1e-300)), dtype=np.float64)
    gap = rating[low] - rating[high]
    largest = _largest_deviations(samples, low, high, error)
    critical = float(np.quantile(largest, LEVEL)) if len(largest) else math.inf
    size = np.abs(gap) / error
    beyond = len(largest) - np.searchsorted(np.sort(largest), size, side="left")
    adjusted = ((1.0 + beyond) / (1.0 + len(largest))).astype(np.float64)
    normal = np.array([math.erfc(value / math.sqrt(2.0)) for value in size])
    return gather_pairs(
        rating,
        differs=size > critical,
        p_value=adjusted,
        holm=holm(normal),
        critical=critical,
        error=error,
        half=float(ndtri(0.5 + LEVEL / 2)) * error,
    )


def gather_pairs(
    rating: FloatArray,
    *,
    differs: BoolArray,
    p_value: FloatArray,
    holm: FloatArray,
    critical: float,
    error: FloatArray,
    half: FloatArray,
) -> Separation:
    """What was found for pairs (P,), in the order of `np.triu_indices`, as squares (C, C)."""
    contestants = len(rating)
    low, high = np.triu_indices(contestants, 1)
    difference = rating[:, None] - rating[None, :]
    apart = np.zeros((contestants, contestants), dtype=bool)
    apart[low, high] = apart[high, low] = differs
    return Separation(
        above=apart & (difference > 0.0),
        p_value=_square_of(contestants, low, high, p_value, 1.0),
        holm=_square_of(contestants, low, high, holm, 1.0),
        critical=critical,
        difference=difference,
        error=_square_of(contestants, low, high, error, 0.0),
        half=_square_of(contestants, low, high, half, 0.0),
    )


def holm(p_values: FloatArray) -> FloatArray:
    """Holm's adjusted p-values (1979) of (n,) p-values, in their order."""
    order = np.argsort(p_values, kind="stable")
    factors = len(p_values) - np.arange(len(p_values))
    stepped = np.minimum(np.maximum.accumulate(p_values[order] * factors), 1.0)
    adjusted = np.empty(len(p_values))
    adjusted[order] = stepped
    return adjusted


def _largest_deviations(
    samples: FloatArray, low: IntArray, high: IntArray, error: FloatArray
) -> FloatArray:
    """(B,) the largest standardised deviation of a difference from its mean, in each round."""
    centred = samples - samples.mean(axis=1, keepdims=True)
    largest = np.zeros(samples.shape[1])
    at_once = max(1, _NUMBERS_AT_ONCE // max(1, samples.shape[1]))
    for first in range(0, len(low), at_once):
        some = slice(first, first + at_once)
        gaps = centred.take(low[some], axis=0)
        gaps -= centred.take(high[some], axis=0)
        gaps /= error[some, None]
        np.maximum(largest, np.abs(gaps, out=gaps).max(axis=0, initial=0.0), out=largest)
    return largest


def _square_of(
    contestants: int, low: IntArray, high: IntArray, values: FloatArray, diagonal: float
) -> FloatArray:
    """(C, C), symmetric, of what pairs have (P,)."""
    square = np.full((contestants, contestants), diagonal)
    square[low, high] = values
    square[high, low] = values
    return square
