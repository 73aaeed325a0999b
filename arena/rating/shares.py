"""Shares of votes with intervals that know that one expert's votes hang together.

Notation: V votes, G clusters.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtri, stdtrit

from arena.rating.comparisons import BoolArray, IntArray
from arena.rating.estimate import LEVEL, Estimate


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
    half = float(stdtrit(groups - 1, 0.5 + LEVEL / 2)) * spread
    return Estimate(value=value, lower=max(value - half, 0.0), upper=min(value + half, 1.0))


def wilson(hits: int, n: int) -> Estimate:
    """Wilson's 95 % interval of `hits` of `n` independent votes."""
    z = float(ndtri(0.5 + LEVEL / 2))
    value = hits / n
    middle = (value + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(value * (1 - value) / n + z * z / (4 * n * n))
    return Estimate(value=value, lower=max(middle - half, 0.0), upper=min(middle + half, 1.0))
