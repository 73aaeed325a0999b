"""By how much experts, and scenarios, differ in what they make of a contestant.

The surplus of the variance that knows of clusters over that of single votes is what their tastes
add: a taste's variance over the number of clusters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from arena.rating.bootstrap import Unit
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Intervals, rate

_ROUNDS = 100
"""They only say who is determined at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effects:
    """Standard deviations in Elo points, on the scale of the rated table; 0 where none is seen."""

    expert_sd: float
    scenario_sd: float


def estimate_effects(votes: Comparisons) -> Effects | None:
    """What past votes say; None where they do not determine ratings with intervals."""
    alone = _mean_variance(votes, Unit.VOTE)
    by_expert, by_scenario = (_mean_variance(votes, unit) for unit in (Unit.EXPERT, Unit.SCENARIO))
    if alone is None or by_expert is None or by_scenario is None:
        return None
    contestants = len(votes.names)
    share = (contestants - 1) / contestants
    experts, scenarios = len(set(votes.expert.tolist())), len(set(votes.scenario.tolist()))
    return Effects(
        expert_sd=math.sqrt(max(by_expert - alone, 0.0) * experts / share),
        scenario_sd=math.sqrt(max(by_scenario - alone, 0.0) * scenarios / share),
    )


def _mean_variance(votes: Comparisons, unit: Unit) -> float | None:
    """Squared points, over the contestants."""
    board = rate(votes, unit=unit, intervals=Intervals.CLOSED_FORM, rounds=_ROUNDS)
    if board.covariance is None:
        return None
    found = float(board.covariance.diagonal().mean())
    return None if math.isnan(found) else found
