"""Bradley-Terry among thousands of contestants: no matrix of all of them is made.

Strengths come from Newton's method with sparse equations. Of the covariance only the variances
are found: what clusters pull, H^-1 s, is squared and added up by random signs (the sketch of
Johnson and Lindenstrauss), around the first term of the inverse, whose squares are exact. So half
widths are right to about a percent (`DRAWN`), whatever the number of cores, and the same seed
gives the same ones.

Notation: R rows, C contestants, P pairs, G clusters, K columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, DidNotConverge
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    renumber_codes,
)
from arena.rating.estimate import LEVEL
from arena.rating.moderated import LEAST, clusters_of, prior_degrees
from arena.rating.student import t_quantile

DRAWN = 192
"""Random signs a cluster gets: the error of a variance is that of its remainder, by the root."""
_NUMBERS_AT_ONCE = 8_000_000
_MOST_STEPS = 100
_MOST_ROUNDS_OF_CG = 2000
_TOLERANCE = 1e-9
_CLOSE = 1e-4
"""Of the sketch, whose own error is a hundred times as large."""


class SparseCurvature:
    """The likelihood's curvature on the space of mean zero.

    Args:
        contestants: C.
        low: (P,) who met.
        high: (P,) whom.
        weight: (P,) how much the pair says of the difference.
    """

    def __init__(
        self, contestants: int, low: IntArray, high: IntArray, weight: FloatArray
    ) -> None:
        self.diagonal = np.bincount(low, weight, contestants) + np.bincount(
            high, weight, contestants
        )
        self._between = _sparse(
            np.concatenate([low, high]),
            np.concatenate([high, low]),
            np.concatenate([weight, weight]),
            (contestants, contestants),
        )

    def solve(self, wanted: FloatArray, *, tolerance: float) -> FloatArray:
        """(C, K) of mean zero, for right sides (C, K) of mean zero, to a relative tolerance.

        Conjugate gradients with the diagonal as preconditioner, all columns at once.

        Raises:
            DidNotConverge: After 2000 rounds some column was not there.
        """
        answer = np.zeros_like(wanted)
        left = wanted.copy()
        scaled = self._scaled(left)
        way = scaled.copy()
        size = (left * scaled).sum(axis=0)
        goal = tolerance**2 * np.maximum(size, 1e-300)
        for _ in range(_MOST_ROUNDS_OF_CG):
            if (size <= goal).all():
                return np.asarray(answer - answer.mean(axis=0))
            bent = self.diagonal[:, None] * way - self._between @ way
            length = size / np.maximum((way * bent).sum(axis=0), 1e-300)
            answer += length * way
            left -= length * bent
            scaled = self._scaled(left)
            now = (left * scaled).sum(axis=0)
            way *= now / np.maximum(size, 1e-300)
            way += scaled
            size = now
        raise DidNotConverge(f"{int((size > goal).sum())} equations were not solved")

    def _scaled(self, left: FloatArray) -> FloatArray:
        found = left / self.diagonal[:, None]
        return np.asarray(found - found.mean(axis=0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ManyFitted:
    """(C,) strengths of mean zero, and the curvature there."""

    strengths: FloatArray
    curvature: SparseCurvature


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variances:
    """(C,) in squared points, and their degrees of freedom; `plain` by the plain sandwich."""

    variance: FloatArray
    degrees: FloatArray
    plain: FloatArray

    def half_widths(self, *, alike: int = 1) -> FloatArray:
        """(C,) of intervals that hold at 95 % for so many contestants at once (Bonferroni)."""
        probability = 1.0 - 0.5 * (1.0 - LEVEL) / alike
        factor = t_quantile(np.maximum(self.degrees, 1.0), probability)
        return np.asarray(factor * np.sqrt(self.variance))


def fit_many(contestants: int, counts: PairCounts) -> ManyFitted:
    """The most likely strengths, to 1e-9; the votes must determine them.

    Raises:
        DidNotConverge: After 100 steps a strength still moved.
    """
    low, high, games, scores = counts.low, counts.high, counts.games, counts.scores
    strengths = np.zeros(contestants)
    for _ in range(_MOST_STEPS):
        expected = 1.0 / (1.0 + np.exp(strengths[high] - strengths[low]))
        curvature = SparseCurvature(contestants, low, high, games * expected * (1.0 - expected))
        surprise = scores - games * expected
        slope = np.bincount(low, surprise, contestants).astype(np.float64)
        slope -= np.bincount(high, surprise, contestants)
        step = curvature.solve(slope[:, None], tolerance=1e-8)[:, 0]
        longest = float(np.abs(step).max())
        if longest < _TOLERANCE:
            return ManyFitted(strengths=strengths - strengths.mean(), curvature=curvature)
        strengths = strengths + step * min(1.0, 2.0 / longest)
    raise DidNotConverge(f"strengths still moved after {_MOST_STEPS} steps")


def variances_of(
    votes: Comparisons, fitted: ManyFitted, unit: Unit, reference: BoolArray, *, seed: int
) -> Variances:
    """How sure the ratings are: what `moderated.spread_of` finds, for the variances alone.

    Args:
        votes: Of contestants who all have votes.
        fitted: By them.
        unit: What hangs together.
        reference: (C,) those whose mean is fixed, and who say what contestants have in common.
        seed: Of the random signs.
    """
    strengths = fitted.strengths
    expected = 1.0 / (1.0 + np.exp(strengths[votes.second] - strengths[votes.first]))
    pull = (votes.score - expected) * votes.count
    information = expected * (1.0 - expected) * votes.count
    kinds = clusters_of(votes, unit)
    rng = np.random.default_rng(seed)

    def squares(cluster_of: IntArray, clusters: int) -> FloatArray:
        sums = _sums(votes, pull, -pull, cluster_of, clusters)
        return _sketched(sums, fitted.curvature, reference, rng)

    if len(kinds) > 1:
        cells, base_of = renumber_codes(kinds[0][1] * kinds[1][0] + kinds[1][1])
        base = squares(base_of, len(cells))
        more = len(cells) / max(len(cells) - 1, 1)
    else:
        # Votes of a row are alike: each is a cluster, so its square counts as often.
        root = np.sqrt(votes.count)
        rows = np.arange(len(votes))
        single = _sums(votes, pull / root, -pull / root, rows, len(votes))
        base, more = _sketched(single, fitted.curvature, reference, rng), 1.0
    found = [
        _component(
            squares(of_row, clusters),
            base,
            _concentration(votes, information, of_row, clusters),
            clusters,
            reference,
        )
        for clusters, of_row in kinds
    ]
    if not found:
        known = base if unit is Unit.VOTE else np.zeros_like(base)
        return Variances(variance=known, degrees=np.full(len(base), 1e9), plain=known)
    variance = sum((one.variance for one in found[1:]), found[0].variance)
    plain = sum((one.plain for one in found[1:]), found[0].plain)
    if len(found) > 1:
        variance, plain = variance - base, plain - base * more
    variance = np.maximum(variance, LEAST * base)
    of_parts = sum(one.variance**2 / one.degrees for one in found)
    return Variances(
        variance=variance,
        degrees=np.asarray(variance**2 / np.maximum(of_parts, 1e-300)),
        plain=np.maximum(plain, 0.0),
    )


# --- Private -----------------------------------------------------------------------------------


def _component(
    raw: FloatArray,
    base: FloatArray,
    uneven: FloatArray,
    clusters: int,
    reference: BoolArray,
) -> Variances:
    """What clusters of one kind add, each contestant's own drawn towards what all have in common.

    The diagonal of `moderated._component`.
    """
    uneven = np.clip(uneven, 1.0 / clusters, 1.0)
    left = 1.0 - uneven
    number = float(reference.sum())
    inner = np.where(reference, uneven, 0.0)
    effects = uneven - 2.0 * inner / number + inner.sum() / number**2
    weight = np.where(reference, 1.0 / np.maximum(base, 1e-9) ** 2, 0.0)
    effect = float((weight * (raw - base * left)).sum())
    effect /= max(float((weight * effects * left).sum()), 1e-300)
    common = np.maximum(base + effect * effects, LEAST * base)
    degrees = left / uneven
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(left > 0.0, raw / left, 0.0)
    prior = prior_degrees(own[reference], common[reference], degrees[reference])
    share = degrees / (prior + degrees)
    everybody = float(degrees[reference].sum()) * (1.0 - 1.0 / number)
    return Variances(
        variance=raw / (prior * uneven + left) + (1.0 - share) * common,
        degrees=np.maximum(np.minimum(prior + degrees, everybody), 1.0),
        plain=raw * clusters / max(clusters - 1, 1),
    )


def _sketched(
    sums: Any, curvature: SparseCurvature, reference: BoolArray, rng: np.random.Generator
) -> FloatArray:
    """(C,) squared points: the sum over clusters of (H^-1 s)^2, for sums s (G, C)."""
    clusters = sums.shape[0]
    first = np.asarray(sums.multiply(sums).sum(axis=0)).ravel() / curvature.diagonal**2
    rest = np.zeros(len(first))
    turned = sums.T.tocsr()
    at_once = int(np.clip(_NUMBERS_AT_ONCE // max(clusters, len(first)), 4, DRAWN))
    drawn = 0
    while drawn < DRAWN:
        signs = 2.0 * rng.integers(0, 2, (clusters, at_once), dtype=np.int8) - 1.0
        pulls = turned @ signs
        found = curvature.solve(pulls - pulls.mean(axis=0), tolerance=_CLOSE)
        found -= found[reference].mean(axis=0)
        rest += (found**2 - (pulls / curvature.diagonal[:, None]) ** 2).sum(axis=1)
        drawn += at_once
    # The remainder is small where everybody met many, and never takes more than nearly all.
    return np.asarray(ELO_PER_LOGIT**2 * np.maximum(first + rest / drawn, 0.05 * first))


def _sums(
    votes: Comparisons,
    of_first: FloatArray,
    of_second: FloatArray,
    cluster_of: IntArray,
    clusters: int,
) -> Any:
    """(G, C) sparse: what the votes of a cluster have for their first and second, added up."""
    return _sparse(
        np.concatenate([cluster_of, cluster_of]),
        np.concatenate([votes.first, votes.second]),
        np.concatenate([of_first, of_second]),
        (clusters, len(votes.names)),
    )


def _concentration(
    votes: Comparisons, information: FloatArray, cluster_of: IntArray, clusters: int
) -> FloatArray:
    """(C,) the sum of squared shares of a contestant's information by cluster."""
    given = _sums(votes, information, information, cluster_of, clusters)
    total = np.asarray(given.sum(axis=0)).ravel()
    squares = np.asarray(given.multiply(given).sum(axis=0), dtype=np.float64).ravel()
    return np.asarray(squares / total**2)


def _sparse(rows: IntArray, columns: IntArray, values: FloatArray, shape: tuple[int, int]) -> Any:
    """Rows of a sparse matrix; what has one place is added up."""
    from scipy.sparse import coo_matrix

    return coo_matrix((values, (rows, columns)), shape=shape).tocsr()
