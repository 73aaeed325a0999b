"""The paper's rank: who can be told apart from whom by their intervals."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arena.rating.comparisons import IntArray


def ranks(lower: ArrayLike, upper: ArrayLike) -> IntArray:
    """One plus the number of others whose lower bound is above this one's upper bound.

    Args:
        lower: (C,) bounds; minus infinity where there is none.
        upper: (C,) bounds; infinity where there is none.

    Returns:
        (C,) ranks from 1; those who can't be told apart share one.
    """
    above = np.asarray(lower, dtype=float)[None, :] > np.asarray(upper, dtype=float)[:, None]
    return np.asarray(1 + above.sum(axis=1), dtype=np.int64)
