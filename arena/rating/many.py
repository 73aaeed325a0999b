"""Bradley-Terry among thousands of contestants: no matrix of all of them is made.

Strengths come from Newton's method with sparse equations; how sure they are is in `sketched`.

Notation: C contestants, P pairs, K columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from arena.rating.bradley_terry import DidNotConverge
from arena.rating.comparisons import FloatArray, IntArray

_MOST_STEPS = 100
_MOST_ROUNDS_OF_CG = 2000
_TOLERANCE = 1e-9
_NEGLIGIBLE = 1e-12
"""Logits: what is smaller is the rounding of sums."""


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
        self._between = sparse_rows(
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
        left = wanted - wanted.mean(axis=0)
        scaled = self._scaled(left)
        way = scaled.copy()
        size = (left * scaled).sum(axis=0)
        goal = np.maximum(tolerance**2 * size, _NEGLIGIBLE**2 * self.diagonal.mean())
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


def fit_many(
    contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> ManyFitted:
    """The most likely strengths, to 1e-9; the votes must determine them.

    Args:
        contestants: C.
        low: (P,) who met.
        high: (P,) whom.
        games: (P,) comparisons of each pair.
        scores: (P,) what `low` scored in them.

    Raises:
        DidNotConverge: After 100 steps a strength still moved.
    """
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


def sparse_rows(
    rows: IntArray, columns: IntArray, values: FloatArray, shape: tuple[int, int]
) -> Any:
    """Rows of a sparse matrix; what has one place is added up."""
    from scipy.sparse import coo_matrix

    return coo_matrix((values, (rows, columns)), shape=shape).tocsr()
