"""Who can be told apart from whom: the paper's rank, rank sets, and all pairs at once.

By intervals in closed form the largest of all standardised differences among equals is drawn as
it comes about: ratings from their covariance, and beside them the squares of so few clusters as
there are, moderated in the same way as those of the data. With three experts every such square is
a rough guess, and the largest of 36 ratios of guesses is far beyond what a normal distribution
has. From the largest difference on, each is held against the largest of those that are left (the
step-down of Westfall and Young 1993, Romano and Wolf 2005).

Notation: C contestants, P pairs, B rounds, N draws.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from arena.rating.comparisons import BoolArray, FloatArray, IntArray
from arena.rating.estimate import LEVEL, t_above, t_quantile
from arena.rating.moderated import LEAST, Component, Spread

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


# --- All pairs at once, by intervals in closed form ----------------------------------------------


SingleArray = NDArray[np.float32]

CAUTION = 1.8
"""What p-values are multiplied by: effects of scenarios are no sums of many, and simulated studies
of equals were told apart up to so much more often than the draws foresee (docs/rating.md)."""
MOST_DRAWN = 300
"""Contestants above whom pairs go by Holm's step-down alone, without draws."""
MOST_ROUNDS = 2000
"""By so many a p-value of 5 % is known to one percent."""
_MANY_CLUSTERS = 200.0
"""So many degrees of freedom make a square as good as known."""
_MOST_KEPT = 20_000_000


def judge_pairs(rating: FloatArray, spread: Spread, *, rounds: int, seed: int) -> Separation:
    """Which pairs of ratings (C,) differ, at 5 % for all of them together.

    Args:
        rating: In points.
        spread: How sure they are.
        rounds: Draws of the largest difference among equals.
        seed: Of the draws.
    """
    contestants = len(rating)
    low, high = np.triu_indices(contestants, 1)
    gap = rating[low] - rating[high]
    # Of 36 pairs some have a small square by chance, and those would be told apart first.
    variance = np.maximum(
        variances_of_pairs(spread.covariance, low, high),
        variances_of_pairs(spread.common, low, high),
    )
    error = np.sqrt(np.maximum(variance, 1e-300))
    size = np.abs(gap) / error
    degrees = np.minimum(spread.degrees[low], spread.degrees[high])
    single = 2.0 * t_above(size, degrees)
    by_holm = holm(single)
    if contestants <= MOST_DRAWN:
        number = min(rounds, MOST_ROUNDS, max(500, _MOST_KEPT // (10 * max(len(low), 1))))
        drawn = _drawn(spread, low, high, number, seed)
        adjusted, critical = _step_down(size, drawn)
    else:
        adjusted, critical = by_holm, float("nan")
    adjusted = np.minimum(CAUTION * adjusted, 1.0)
    differs = adjusted <= 1.0 - LEVEL
    return gather_pairs(
        rating,
        differs=differs,
        p_value=adjusted,
        holm=by_holm,
        critical=critical,
        error=error,
        half=t_quantile(degrees) * error,
    )


def draw_equals(
    spread: Spread, low: IntArray, high: IntArray, *, rounds: int, seed: int
) -> tuple[SingleArray, SingleArray, SingleArray]:
    """(N, P) each: differences of equals, and two variances that would be found for them.

    The first is moderated, the second what it would be if all contestants were taken for alike.
    In single precision: they are compared, once.

    Args:
        spread: Of the ratings.
        low: (P,) one of each pair.
        high: (P,) the other one.
        rounds: N.
        seed: Of the draws.
    """
    rng = np.random.default_rng(seed)
    contestants = len(spread.covariance)
    root = _root(spread.common)
    base = variances_of_pairs(spread.base, low, high)
    taken_off = max(len(spread.components) - 1, 0) * base
    clusters = sum(component.own_degrees.max(initial=1.0) for component in spread.components)
    at_once = int(max(1, _NUMBERS_AT_ONCE // (contestants * (contestants + clusters))))
    roots = [_root(component.common) for component in spread.components]
    gaps: SingleArray = np.empty((rounds, len(low)), dtype=np.float32)
    variances, commons = np.empty_like(gaps), np.empty_like(gaps)
    for first in range(0, rounds, at_once):
        block = slice(first, min(first + at_once, rounds))
        number = block.stop - first
        ratings = rng.standard_normal((number, contestants), dtype=np.float32) @ root
        gaps[block] = ratings.take(low, axis=1) - ratings.take(high, axis=1)
        variances[block] = commons[block] = -taken_off
        if not spread.components:
            variances[block] += variances_of_pairs(spread.covariance, low, high)
        for component, of_component in zip(spread.components, roots, strict=True):
            own, common = _variances(component, of_component, low, high, number, rng)
            variances[block] += own
            commons[block] += common
    for found, least in ((variances, LEAST * base), (commons, base)):
        np.maximum(found, np.maximum(least, 1e-30).astype(np.float32), out=found)
    return gaps, variances, commons


def variances_of_pairs(covariance: FloatArray, low: IntArray, high: IntArray) -> FloatArray:
    """(P,) variances of differences, from a covariance (C, C)."""
    variance = covariance.diagonal()
    return np.asarray(variance[low] + variance[high] - 2.0 * covariance[low, high])


def _drawn(spread: Spread, low: IntArray, high: IntArray, rounds: int, seed: int) -> SingleArray:
    """(P, N) standardised differences of equals."""
    gaps, variances, _ = draw_equals(spread, low, high, rounds=rounds, seed=seed)
    np.sqrt(variances, out=variances)
    return np.abs(np.divide(gaps, variances, out=gaps), out=gaps).T


def _variances(
    one: Component,
    root: SingleArray,
    low: IntArray,
    high: IntArray,
    number: int,
    rng: np.random.Generator,
) -> tuple[SingleArray, SingleArray]:
    """(N, P), (N, P): what a component would add to the two variances of `draw_equals`."""
    degrees = float(np.median(one.own_degrees))
    common = variances_of_pairs(one.common, low, high).astype(np.float32)
    if degrees >= _MANY_CLUSTERS:
        known = np.broadcast_to(common, (number, len(low)))
        return known, known
    clusters = max(1, round(degrees))
    contestants = len(one.common)
    pulls = rng.standard_normal((number, clusters, contestants), dtype=np.float32) @ root
    seen = np.einsum("ngc,ngc,c->n", pulls, pulls, _over(one.common.diagonal()))
    seen /= np.float32(clusters * contestants)
    others = np.sqrt(1.0 - one.own_share)
    shared = variances_of_pairs(others[:, None] * one.common * others, low, high).astype(
        np.float32
    )
    pulls *= np.sqrt(one.own_share / clusters).astype(np.float32)
    squares = np.matmul(pulls.transpose(0, 2, 1), pulls)
    variance = np.diagonal(squares, axis1=1, axis2=2)
    own = variance.take(low, axis=1) + variance.take(high, axis=1)
    own -= np.float32(2.0) * squares.reshape(number, -1).take(low * contestants + high, axis=1)
    own += seen[:, None] * shared
    return np.asarray(own), np.asarray(seen[:, None] * common)


def _over(values: FloatArray) -> SingleArray:
    """One over each."""
    return np.asarray(1.0 / np.maximum(values, 1e-30), dtype=np.float32)


def _root(covariance: FloatArray) -> SingleArray:
    """(C, C): standard normal rows times it have the covariance."""
    values, directions = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * directions.T
    return np.asarray(root, dtype=np.float32)


def _step_down(size: FloatArray, drawn: SingleArray) -> tuple[FloatArray, float]:
    """(P,) adjusted p-values of sizes (P,), and what the largest must exceed."""
    order = np.argsort(size, kind="stable")
    largest = np.maximum.accumulate(drawn[order], axis=0)
    rounds = drawn.shape[1]
    reached = (largest >= size[order, None]).sum(axis=1)
    stepped = (1.0 + reached) / (1.0 + rounds)
    adjusted = np.empty(len(size))
    adjusted[order] = np.maximum.accumulate(stepped[::-1])[::-1]
    critical = float(np.quantile(largest[-1], LEVEL)) if len(size) else float("inf")
    return adjusted, critical
