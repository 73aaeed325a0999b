"""Who scored what against whom, with counts.

Notation: C contestants.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arena.rating.comparisons import Comparisons, FloatArray, IntArray, count_pairs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WinRates:
    """Counts of every ordered pair; the diagonal is zero.

    Attributes:
        wins: (C, C) how often the row's contestant beat the column's.
        ties: (C, C), symmetric.
    """

    wins: IntArray
    ties: IntArray

    @property
    def votes(self) -> IntArray:
        """(C, C) comparisons of each pair."""
        return np.asarray(self.wins + self.wins.T + self.ties)

    @property
    def scores(self) -> FloatArray:
        """(C, C) the row's mean score against the column, ties half; NaN without votes."""
        votes = self.votes
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.where(votes > 0, (self.wins + 0.5 * self.ties) / votes, np.nan))


def win_rates(votes: Comparisons) -> WinRates:
    """Count every pair."""
    contestants = len(votes.names)
    counts = count_pairs(votes)
    wins = np.zeros((contestants, contestants), dtype=np.int64)
    ties = np.zeros_like(wins)
    wins[counts.low, counts.high] = counts.outcomes[:, 0]
    wins[counts.high, counts.low] = counts.outcomes[:, 2]
    ties[counts.low, counts.high] = ties[counts.high, counts.low] = counts.outcomes[:, 1]
    return WinRates(wins=wins, ties=ties)
