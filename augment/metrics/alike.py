"""Whether two changes of one scene differ by so little that nobody can tell them apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from augment.geometry.frames import difference
from augment.scene.entities import AgentType, Modification, TrafficAgent

_UPRIGHT = frozenset({AgentType.TRAFFIC_CONE, AgentType.CONSTRUCTION_SIGN})
"""Drawn upright whatever their heading."""
_SHOWN_S = 1.0
"""A picture shows the motion of so much time as an arrow."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """Up to which difference two objects look the same, the limits included."""

    distance_m: float = 0.15
    heading_rad: float = math.radians(2.0)


def are_alike(one: Modification, other: Modification, within: Likeness | None = None) -> bool:
    """Whether every object of either change has a counterpart in the other within a tolerance.

    Place, size, end of a walk and motion in a second are held against the distance. What is
    moved and what is removed must be the same.
    """
    limits = within or Likeness()
    moved = [{agent.id: agent for agent in change.moved} for change in (one, other)]
    return (
        set(one.removed) == set(other.removed)
        and moved[0].keys() == moved[1].keys()
        and all(_look_alike(agent, moved[1][name], limits) for name, agent in moved[0].items())
        and _all_matched(list(one.added), list(other.added), limits)
    )


def _all_matched(one: list[TrafficAgent], other: list[TrafficAgent], limits: Likeness) -> bool:
    """Whether a one-to-one matching within the tolerance exists."""
    from scipy.optimize import linear_sum_assignment

    if len(one) != len(other):
        return False
    apart = np.array([[not _look_alike(a, b, limits) for b in other] for a in one]).reshape(
        len(one), len(other)
    )
    rows, columns = linear_sum_assignment(apart)
    return not apart[rows, columns].any()


def _look_alike(one: TrafficAgent, other: TrafficAgent, limits: Likeness) -> bool:
    if one.type is not other.type or (one.walk_to_m is None) != (other.walk_to_m is None):
        return False
    gaps_m = [
        math.dist((one.x_m, one.y_m), (other.x_m, other.y_m)),
        abs(one.length_m - other.length_m),
        abs(one.width_m - other.width_m),
        abs(one.speed_mps - other.speed_mps) * _SHOWN_S,
    ]
    if one.walk_to_m is not None and other.walk_to_m is not None:
        gaps_m.append(math.dist(one.walk_to_m, other.walk_to_m))
    turn = 0.0 if one.type in _UPRIGHT else abs(difference(one.heading_rad, other.heading_rad))
    return max(gaps_m) <= limits.distance_m + 1e-9 and turn <= limits.heading_rad + 1e-9
