"""A number and how sure it is; shares of votes; Student's t.

Notation: V votes, G clusters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtr, stdtrit

from arena.rating.comparisons import BoolArray, FloatArray, IntArray

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
    """Return what t is below with a probability above a half."""
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
    found, cluster = np.unique(clusters, return_inverse=True)
    surplus = np.bincount(cluster, weights=hits - value, minlength=len(found))
    groups = len(found)
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
