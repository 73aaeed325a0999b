"""Separation of contestants: the paper's rank, rank sets, and all pairs at once.

By intervals in closed form the largest of all standardised differences among equals is drawn as
it comes about: ratings from their covariance, and beside them the squares of so few clusters as
there are, moderated in the same way as those of the data. With three experts every such square is
a rough guess, and the largest of 36 ratios of guesses is far beyond what a normal distribution
has. From the largest difference on, each is held against the largest of those that are left (the
step-down of Westfall and Young 1993, Romano and Wolf 2005).

Notation: C contestants, P pairs in the order of np.triu_indices, B rounds, N draws.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arena.rating.comparisons import LEVEL, BoolArray, FloatArray, IntArray, t_above, t_quantile
from arena.rating.sandwich import LEAST, Component, Spread

SingleArray = NDArray[np.float32]

CAUTION = 1.8
"""What p-values are multiplied by: effects of scenarios are no sums of many, and simulated studies
of equals were told apart up to so much more often than the draws foresee (docs/rating.md)."""
FEWEST_TO_JUDGE = 5
"""Experts, and scenarios, of whom "at 5 % for the whole table" is said without a hedge. Of fewer
equals were told apart up to twice as often again."""
MOST_DRAWN = 300
"""Contestants above whom pairs go by Holm's step-down alone, without draws."""
MOST_ROUNDS = 2000
"""By so many a p-value of 5 % is known to one percent."""
_MANY_CLUSTERS = 200.0
"""So many degrees of freedom make a square as good as known."""
# Ten times the standardised differences (P * N) that draws hold, but for 500 draws.
_MOST_KEPT = 20_000_000
# Numbers in a block of rounds or draws: for memory alone.
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
    # How many lower bounds are at most this upper bound.
    not_above = np.searchsorted(lowest_first, np.asarray(upper, dtype=float), side="right")
    return np.asarray(1 + len(lowest_first) - not_above, dtype=np.int64)


def decide_ranks(lower: FloatArray, upper: FloatArray, *, average: float) -> IntArray:
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
    low = np.where(no_lower, -np.inf, lower)
    places = ranks(low, np.where(no_upper, np.inf, upper))
    decided = (places > 1) | ~(no_lower | no_upper) | (no_upper & (low > average))
    return np.where(decided, places, 0)


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


def above_in_rounds(rating: FloatArray, samples: FloatArray) -> BoolArray:
    """(C, C) who is above whom by the largest standardised difference of rounds (max-t).

    Args:
        rating: (C,) of the data.
        samples: (C, B) of the rounds.
    """
    low, high = np.triu_indices(len(rating), 1)
    # (P,) of differences over the rounds.
    variance = variances_of_pairs(np.atleast_2d(np.cov(samples)), low, high)
    error = np.sqrt(np.maximum(variance, 1e-300))
    centred = samples - samples.mean(axis=1, keepdims=True)
    # (B,) of each round, over all pairs: in blocks, as (P, B) may not fit into memory.
    largest = np.zeros(samples.shape[1])
    at_once = max(1, _NUMBERS_AT_ONCE // max(1, samples.shape[1]))
    for first in range(0, len(low), at_once):
        some = slice(first, first + at_once)
        gaps = centred[low[some]]
        gaps -= centred[high[some]]
        gaps /= error[some, None]
        np.maximum(largest, np.abs(gaps, out=gaps).max(axis=0, initial=0.0), out=largest)
    # In 95 % of rounds no pair at all moves by more: that holds for the whole table.
    critical = float(np.quantile(largest, LEVEL)) if len(largest) else np.inf
    apart = _to_square(len(rating), np.abs(rating[low] - rating[high]) / error > critical, False)
    return apart & (rating[:, None] > rating[None, :])


# --- All pairs at once, by intervals in closed form ----------------------------------------------


_SINCE_5 = {"since": 5}
"""Of fields that stored documents of earlier versions do not have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairP:
    """Probability among equals of a difference as large as that of `a` and `b`, in any pair.

    Attributes:
        difference: Points by which `a` is above `b`; `lower` and `upper` are of its own interval.
    """

    a: str
    b: str
    p: float
    difference: float | None = field(default=None, metadata=_SINCE_5)
    lower: float | None = field(default=None, metadata=_SINCE_5)
    upper: float | None = field(default=None, metadata=_SINCE_5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Separation:
    """Pairs that differ, all judged at once: the error is 5 % for the whole table.

    Attributes:
        above: (C, C) whether the row's contestant is above the column's.
        p_value: (C, C) adjusted for all pairs, symmetric; 1 on the diagonal.
        difference: (C, C) the row's rating minus the column's.
        half: (C, C) half the width of the difference's own 95 % interval.
    """

    above: BoolArray
    p_value: FloatArray
    difference: FloatArray
    half: FloatArray

    def judge_pairs(self, names: Sequence[str]) -> tuple[PairP, ...]:
        """Return every pair that was judged, by the names of the C contestants."""
        low, high = np.triu_indices(len(names), 1)
        is_compared = ~np.isnan(self.p_value[low, high])
        low, high = low[is_compared], high[is_compared]
        p, gap, half = (square[low, high] for square in (self.p_value, self.difference, self.half))
        columns = (low, high, p, gap, gap - half, gap + half)
        return tuple(
            PairP(a=names[i], b=names[j], p=p_value, difference=points, lower=lower, upper=upper)
            for i, j, p_value, points, lower, upper in zip(
                *(column.tolist() for column in columns), strict=True
            )
        )

    def among(self, members: IntArray, contestants: int) -> Self:
        """The same with rows for all: these members' stay, the others differ from nobody."""
        if len(members) == contestants:
            return self
        places = np.ix_(members, members)
        above = np.zeros((contestants, contestants), dtype=bool)
        above[places] = self.above
        wide = np.full((3, contestants, contestants), np.nan)
        for square, own in zip(wide, (self.p_value, self.difference, self.half), strict=True):
            square[places] = own
        return type(self)(above=above, p_value=wide[0], difference=wide[1], half=wide[2])


def join_separations(separations: Sequence[Separation], across: BoolArray) -> Separation | None:
    """Join those of parts that were rated apart; None where nothing was judged.

    Args:
        separations: With rows for all C contestants, NaN outside of the part; each at 5 %, which
            they share.
        across: (C, C) who is shown to be above somebody of another part.
    """
    if not separations and not across.any():
        return None
    unknown = np.full(across.shape, np.nan)
    # fmax passes over NaN: two contestants were judged in one part at most.
    p_value, difference, half = (
        np.fmax.reduce([unknown, *(getattr(part, name) for part in separations)])
        for name in ("p_value", "difference", "half")
    )
    # Bonferroni: the parts share the 5 %.
    p_value = np.minimum(len(separations) * p_value, 1.0)
    above = (p_value <= 1.0 - LEVEL) & (difference > 0.0)
    return Separation(above=above | across, p_value=p_value, difference=difference, half=half)


def judge_pairs(rating: FloatArray, spread: Spread, *, rounds: int, seed: int) -> Separation:
    """Return the pairs of ratings (C,) that differ, at 5 % for all of them together.

    Args:
        rating: In points.
        spread: How sure they are.
        rounds: Draws of the largest difference among equals.
        seed: Of the draws.
    """
    contestants = len(rating)
    low, high = np.triu_indices(contestants, 1)
    # Of 36 pairs some have a small square by chance, and those would be told apart first.
    variance = np.maximum(
        variances_of_pairs(spread.covariance, low, high),
        variances_of_pairs(spread.common, low, high),
    )
    error = np.sqrt(np.maximum(variance, 1e-300))
    size = np.abs(rating[low] - rating[high]) / error
    # (P,): the less certain of the two decides.
    degrees = np.minimum(spread.degrees[low], spread.degrees[high])
    if contestants <= MOST_DRAWN:
        number = min(rounds, MOST_ROUNDS, max(500, _MOST_KEPT // (10 * max(len(low), 1))))
        adjusted = _step_down(size, draw_equals(spread, rounds=number, seed=seed))
    else:
        adjusted = holm(2.0 * t_above(size, degrees))
    caution = CAUTION if spread.fewest >= FEWEST_TO_JUDGE else 2.0 * CAUTION
    adjusted = np.minimum(caution * adjusted, 1.0)
    difference = rating[:, None] - rating[None, :]
    apart = _to_square(contestants, adjusted <= 1.0 - LEVEL, False)
    return Separation(
        above=apart & (difference > 0.0),
        p_value=_to_square(contestants, adjusted, 1.0),
        difference=difference,
        half=_to_square(contestants, t_quantile(degrees) * error, 0.0),
    )


def holm(p_values: FloatArray) -> FloatArray:
    """Holm's adjusted p-values (1979) of (n,) p-values, in their order."""
    order = np.argsort(p_values, kind="stable")
    # From the smallest on times n, n - 1, ..., 1, and never less than the one before.
    factors = len(p_values) - np.arange(len(p_values))
    stepped = np.minimum(np.maximum.accumulate(p_values[order] * factors), 1.0)
    adjusted = np.empty(len(p_values))
    adjusted[order] = stepped
    return adjusted


def draw_equals(spread: Spread, *, rounds: int, seed: int) -> SingleArray:
    """(P, N) standardised differences of equals, by the variances that would be found for them.

    In single precision: they are compared, once.
    """
    rng = np.random.default_rng(seed)
    contestants = len(spread.covariance)
    low, high = np.triu_indices(contestants, 1)
    base = variances_of_pairs(spread.base, low, high)
    # (P,): with two kinds of clusters the cells are in both, as in `estimate_spread`.
    taken_off = max(len(spread.components) - 1, 0) * base
    least = np.maximum(LEAST * base, 1e-30).astype(np.float32)
    clusters = sum(component.own_degrees.max(initial=1.0) for component in spread.components)
    # A draw makes pulls (G, C) and their squares (C, C).
    at_once = int(max(1, _NUMBERS_AT_ONCE // (contestants * (contestants + clusters))))
    root = _root(spread.common)
    roots = [_root(component.common) for component in spread.components]
    drawn: SingleArray = np.empty((rounds, len(low)), dtype=np.float32)
    for first in range(0, rounds, at_once):
        number = min(at_once, rounds - first)
        # (N, C) ratings of equals, around 0.
        ratings = rng.standard_normal((number, contestants), dtype=np.float32) @ root
        variances: SingleArray = np.empty((number, len(low)), dtype=np.float32)
        variances[:] = -taken_off
        if not spread.components:
            variances += variances_of_pairs(spread.covariance, low, high).astype(np.float32)
        for component, of_component in zip(spread.components, roots, strict=True):
            variances += _draw_variances(component, of_component, low, high, number, rng)
        # (N, P), each over the error that its own draw of squares would show.
        gaps = np.abs(ratings.take(low, axis=1) - ratings.take(high, axis=1))
        drawn[first : first + number] = gaps / np.sqrt(np.maximum(variances, least))
    return drawn.T


def variances_of_pairs(covariance: FloatArray, low: IntArray, high: IntArray) -> FloatArray:
    """(P,) variances of differences, from a covariance (C, C)."""
    variance = covariance.diagonal()
    return np.asarray(variance[low] + variance[high] - 2.0 * covariance[low, high])


def _draw_variances(
    component: Component,
    root: SingleArray,
    low: IntArray,
    high: IntArray,
    number: int,
    rng: np.random.Generator,
) -> SingleArray:
    """(N, P) what a component would add to the variances of differences."""
    degrees = float(np.median(component.own_degrees))
    if degrees >= _MANY_CLUSTERS:
        variances = variances_of_pairs(component.common, low, high).astype(np.float32)
        return np.broadcast_to(variances, (number, len(low)))
    clusters, contestants = max(1, round(degrees)), len(component.common)
    # (N, G, C) effects of G clusters, each with the covariance `common`.
    pulls = rng.standard_normal((number, clusters, contestants), dtype=np.float32) @ root
    weights = 1.0 / np.maximum(component.common.diagonal(), 1e-30)
    # (N,) how large the common variance would be found, 1 on average.
    seen = np.einsum("ngc,ngc,c->n", pulls, pulls, weights.astype(np.float32))
    seen /= np.float32(clusters * contestants)
    others = np.sqrt(1.0 - component.own_share)
    moderated = others[:, None] * component.common * others
    shared = variances_of_pairs(moderated, low, high).astype(np.float32)
    # pulls' pulls (N, C, C) is then the own square, a mean over clusters, by its weight.
    pulls *= np.sqrt(component.own_share / clusters).astype(np.float32)
    squares = np.matmul(pulls.transpose(0, 2, 1), pulls)
    variance = np.diagonal(squares, axis1=1, axis2=2)
    # (N, P): v_i + v_j - 2 c_ij, the last by the flat place i * C + j.
    own = variance.take(low, axis=1) + variance.take(high, axis=1)
    own -= np.float32(2.0) * squares.reshape(number, -1).take(low * contestants + high, axis=1)
    own += seen[:, None] * shared
    return np.asarray(own)


def _root(covariance: FloatArray) -> SingleArray:
    """(C, C): standard normal rows times it have the covariance."""
    # Not Cholesky's: the covariance is singular along the shift of all ratings.
    values, directions = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * directions.T
    return np.asarray(root, dtype=np.float32)


def _step_down(size: FloatArray, drawn: SingleArray) -> FloatArray:
    """(P,) adjusted p-values of sizes (P,), by those of equals (P, N)."""
    order = np.argsort(size, kind="stable")
    # (P, N), smallest difference first: the largest draw of this pair and of all before it.
    largest = np.maximum.accumulate(drawn[order], axis=0)
    reached = (largest >= size[order, None]).sum(axis=1)
    # The data count as one more draw, so that no p-value is 0.
    stepped = (1.0 + reached) / (1.0 + drawn.shape[1])
    adjusted = np.empty(len(size))
    # From the largest difference down p-values never become smaller.
    adjusted[order] = np.maximum.accumulate(stepped[::-1])[::-1]
    return adjusted


def _to_square(contestants: int, values: NDArray[Any], diagonal: float) -> NDArray[Any]:
    """(C, C), symmetric, of what pairs have (P,)."""
    low, high = np.triu_indices(contestants, 1)
    square = np.full((contestants, contestants), diagonal, dtype=values.dtype)
    square[low, high] = square[high, low] = values
    return square
