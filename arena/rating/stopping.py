"""A stopping rule that holds however often it is looked at: looks fixed in advance, error spent.

Whoever looks at intervals again and again and stops when they like them has wrong ones more often
than they say. Here the looks are fixed before the first vote, and the 5 % are shared among them by
a spending function (Lan and DeMets 1983, of Pocock's kind, alpha(t) = 0.05 ln(1 + (e - 1) t)): all
intervals of all looks hold together with 95 %. So the rule may use anything that a look shows.

Confidence sequences that hold at any time were the alternative. They need the variance of a sum of
independent votes, which votes of few experts on few scenarios are not; and they are wider at every
look than what five looks need.

The limits are those of a Brownian motion with these information times (Armitage, McPherson and
Rowe 1969). Where experts or scenarios differ, looks hang together more closely, which only
makes it likelier that all intervals hold. docs/coverage.md has both simulated.

Notation: K looks, at shares t of all votes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, stdtr, stdtrit

from arena.rating.comparisons import FloatArray
from arena.rating.estimate import LEVEL
from arena.rating.leaderboard import Leaderboard

LOOKS, MOST_LOOKS = 5, 20
_POINTS = 601
_AREAS = 1.0 - LEVEL


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingRule:
    """When a study is to close.

    Attributes:
        half_width: When every interval of a look is at most ± so many points; None for never.
        votes: At so many counted votes at the latest; None for all that are planned.
        looks: How often intervals are looked at, at equal distances.
        closes: Whether the study is closed then; else an admin is told.

    Raises:
        ValueError: Something is out of range; the text says what is allowed.
    """

    half_width: float | None = None
    votes: int | None = None
    looks: int = LOOKS
    closes: bool = False

    def __post_init__(self) -> None:
        if self.half_width is None and self.votes is None:
            raise ValueError("a stopping rule needs a half-width or a number of votes")
        if self.half_width is not None and not 0.0 < self.half_width < math.inf:
            raise ValueError(f"the half-width must be more than 0, not {self.half_width}")
        if self.votes is not None and self.votes < 1:
            raise ValueError(f"the number of votes must be 1 or more, not {self.votes}")
        if not 1 <= self.looks <= MOST_LOOKS:
            raise ValueError(f"looks go from 1 to {MOST_LOOKS}, not {self.looks}")

    def last_votes(self, planned: int) -> int:
        """The votes at which the study closes at the latest."""
        return planned if self.votes is None else min(self.votes, planned)

    def look_votes(self, planned: int) -> tuple[int, ...]:
        """The votes at which to look; the last look is where the study closes anyway."""
        last = self.last_votes(planned)
        if self.half_width is None:
            return (last,)
        points = {math.ceil(last * number / self.looks) for number in range(1, self.looks + 1)}
        return tuple(sorted(points))


def spent(share: float) -> float:
    """How much of the 5 % may be spent when so much of all votes is there."""
    return _AREAS * math.log1p((math.e - 1.0) * min(share, 1.0))


def look_levels(shares: Sequence[float]) -> list[float]:
    """The chance of an error that the intervals of each look have, two-sided.

    Args:
        shares: Of all votes, at each look so far; rising, the last one at most 1.

    Raises:
        ValueError: They do not rise from above 0 to at most 1.
    """
    if not all(0.0 < share <= 1.0 for share in shares) or list(shares) != sorted(set(shares)):
        raise ValueError(f"shares rise from above 0 to at most 1, not {list(shares)}")
    levels: list[float] = []
    before, used = 0.0, 0.0
    places, density = np.zeros(1), np.ones(1)
    for share in shares:
        step = math.sqrt(share - before)
        limit = _limit(places, density, step, spent(share) - used)
        levels.append(2.0 * float(ndtr(-limit / math.sqrt(share))))
        places, density = _carried_on(places, density, step, limit)
        before, used = share, spent(share)
    return levels


def widest_half_width(board: Leaderboard, level: float) -> float | None:
    """Points of the widest interval of a rating whose intervals err with such a chance.

    None where some contestant has no interval, or one that is open on a side.
    """
    if board.covariance is None:
        return None
    bounds = [(line.lower, line.upper) for line in board.lines]
    if not bounds or any(lower is None or upper is None for lower, upper in bounds):
        return None
    variance = board.covariance.diagonal()
    if not bool((variance > 0.0).all()):
        return None
    lower, upper = np.array(bounds, dtype=np.float64).T
    degrees = _degrees_of((upper - lower) / 2.0 / np.sqrt(variance))
    factor = stdtrit(degrees, 1.0 - level / 2.0)
    return float((factor * np.sqrt(variance)).max())


# --- Private -----------------------------------------------------------------------------------


def _limit(places: FloatArray, density: FloatArray, step: float, error: float) -> float:
    """Beyond which a path ends with such a chance at this look."""
    low, high = 0.0, 12.0
    for _ in range(60):
        middle = (low + high) / 2.0
        outside = ndtr((places - middle) / step) + ndtr((-places - middle) / step)
        chance = float((outside * density).sum())
        low, high = (middle, high) if chance > error else (low, middle)
    return (low + high) / 2.0


def _carried_on(
    places: FloatArray, density: FloatArray, step: float, limit: float
) -> tuple[FloatArray, FloatArray]:
    """Where paths that have not ended are at the next look, and how many."""
    after = np.linspace(-limit, limit, _POINTS)
    weights = np.full(_POINTS, after[1] - after[0])
    weights[[0, -1]] /= 2.0
    kernel = np.exp(-(((after[:, None] - places) / step) ** 2) / 2.0)
    found = kernel @ density / (step * math.sqrt(2.0 * math.pi))
    return after, np.asarray(found * weights)


def _degrees_of(factor: FloatArray) -> FloatArray:
    """(C,) degrees of freedom at which 95 % intervals have so many standard errors (C,)."""
    low, high = np.zeros(len(factor)), np.full(len(factor), math.log(1e7))
    for _ in range(40):
        middle = (low + high) / 2.0
        wide = stdtr(np.exp(middle), factor) < 0.5 + LEVEL / 2.0
        low, high = np.where(wide, middle, low), np.where(wide, high, middle)
    return np.asarray(np.exp(high))
