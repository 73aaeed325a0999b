"""All pairs judged at once by intervals in closed form: who differs at 5 % for the whole table.

The largest of all standardised differences among equals is drawn as it comes about: ratings from
their covariance, and beside them the squares of so few clusters as there are, moderated in the
same way as those of the data. With three experts every such square is a rough guess, and the
largest of 36 ratios of guesses is far beyond what a normal distribution has. From the
largest difference on, each is held against the largest of those that are left (the step-down of
Westfall and Young 1993, Romano and Wolf 2005).

Notation: C contestants, P pairs, N draws.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import FloatArray, IntArray
from arena.rating.estimate import LEVEL
from arena.rating.moderated import LEAST, Component, Spread
from arena.rating.ranking import Separation, gather_pairs, holm
from arena.rating.student import t_above, t_quantile

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
_NUMBERS_AT_ONCE = 2_000_000
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


# --- Private -----------------------------------------------------------------------------------


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
