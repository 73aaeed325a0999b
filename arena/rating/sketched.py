"""How sure ratings of thousands of contestants are: variances without a matrix of all of them.

What clusters pull, H^-1 s, is squared and added up by random signs (the sketch of Johnson and
Lindenstrauss), around the first term of the inverse, whose squares are exact. So half-widths are
right to about a percent (`DRAWN`), and the same seed gives the same ones, whatever the number of
cores.

Notation: R rows, C contestants, G clusters.
"""

from __future__ import annotations

from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    renumber_codes,
)
from arena.rating.estimate import LEVEL
from arena.rating.many import ManyFitted, SparseCurvature, sparse_rows
from arena.rating.moderated import LEAST, clusters_of, prior_degrees
from arena.rating.student import t_quantile

DRAWN = 192
"""Random signs a cluster gets: the error of a variance is that of its remainder, by the root."""
_NUMBERS_AT_ONCE = 4_000_000
_MOST_AT_ONCE = 48
_CLOSE = 1e-4
"""Of the sketch, whose own error is a hundred times as large."""


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


def variances_of(
    votes: Comparisons,
    fitted: ManyFitted,
    unit: Unit,
    reference: BoolArray,
    *,
    seed: int,
    workers: int = 1,
) -> Variances:
    """How sure the ratings are: what `moderated.spread_of` finds, for the variances alone.

    Args:
        votes: Of contestants who all have votes.
        fitted: By them.
        unit: What hangs together.
        reference: (C,) those whose mean is fixed, and who say what contestants have in common.
        seed: Of the random signs.
        workers: Threads, two at most, for the sake of memory; the answer does not depend on them.
    """
    with ThreadPoolExecutor(min(workers, 2)) as pool:
        return _variances_of(votes, fitted, unit, reference, np.random.default_rng(seed), pool)


# --- Private -----------------------------------------------------------------------------------


def _variances_of(
    votes: Comparisons,
    fitted: ManyFitted,
    unit: Unit,
    reference: BoolArray,
    rng: np.random.Generator,
    pool: Executor,
) -> Variances:
    strengths = fitted.strengths
    expected = 1.0 / (1.0 + np.exp(strengths[votes.second] - strengths[votes.first]))
    pull = (votes.score - expected) * votes.count
    information = expected * (1.0 - expected) * votes.count
    kinds = clusters_of(votes, unit)

    def squares(cluster_of: IntArray, clusters: int) -> FloatArray:
        sums = _sums(votes, pull, -pull, cluster_of, clusters)
        return _sketched(sums, fitted.curvature, reference, rng, pool)

    if len(kinds) > 1:
        cells, base_of = renumber_codes(kinds[0][1] * kinds[1][0] + kinds[1][1])
        base = squares(base_of, len(cells))
        more = len(cells) / max(len(cells) - 1, 1)
    else:
        # Votes of a row are alike: each is a cluster, so its square counts as often.
        root = np.sqrt(votes.count)
        rows = np.arange(len(votes))
        single = _sums(votes, pull / root, -pull / root, rows, len(votes))
        base, more = _sketched(single, fitted.curvature, reference, rng, pool), 1.0
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
    sums: Any,
    curvature: SparseCurvature,
    reference: BoolArray,
    rng: np.random.Generator,
    pool: Executor,
) -> FloatArray:
    """(C,) squared points: the sum over clusters of (H^-1 s)^2, for sums s (G, C)."""
    clusters = sums.shape[0]
    first = np.asarray(sums.multiply(sums).sum(axis=0)).ravel() / curvature.diagonal**2
    turned = sums.T.tocsr()
    at_once = int(np.clip(_NUMBERS_AT_ONCE // max(clusters, len(first)), 4, _MOST_AT_ONCE))
    blocks = -(-DRAWN // at_once)

    def remainder(of_block: np.random.Generator) -> FloatArray:
        signs = 2.0 * of_block.integers(0, 2, (clusters, at_once), dtype=np.int8) - 1.0
        pulls = turned @ signs
        found = curvature.solve(pulls - pulls.mean(axis=0), tolerance=_CLOSE)
        found -= found[reference].mean(axis=0)
        pulls /= curvature.diagonal[:, None]
        return np.asarray((found**2 - pulls**2).sum(axis=1))

    rest = sum(pool.map(remainder, rng.spawn(blocks)), np.zeros(len(first)))
    rest /= blocks * at_once
    # The remainder is small where everybody met many, and never takes more than nearly all.
    return np.asarray(ELO_PER_LOGIT**2 * np.maximum(first + rest, 0.05 * first))


def _sums(
    votes: Comparisons,
    of_first: FloatArray,
    of_second: FloatArray,
    cluster_of: IntArray,
    clusters: int,
) -> Any:
    """(G, C) sparse: what the votes of a cluster have for their first and second, added up."""
    return sparse_rows(
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
