"""What a planner is given and what it gives back; whoever fits `Planner` can be driven.

A planner of your own is a class without arguments in a module that can be imported, named by its
dotted path (docs/simulation.md has an example).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from augment.simulation.road import Road
from augment.simulation.states import EgoBody, FloatArray, Objects


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """One moment, as a planner sees it.

    Attributes:
        step: Counted from 0, `STEP_S` apart.
        ego: The state (6,) of the rear axle.
        objects: Everybody who is there, wherever they are.
    """

    step: int
    ego: FloatArray
    objects: Objects


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proposals:
    """What a planner considered, for people to look at; nothing depends on it.

    Attributes:
        states: (B, T, 3 or more): rear-axle poses over the planner's horizon.
        scores: (B,).
        chosen: The row that won.
    """

    states: FloatArray
    scores: FloatArray
    chosen: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """What the ego is to do.

    Attributes:
        poses: (T, 3), rear axle, every `STEP_S` from this moment on, T >= 2. The tracker reads
            a second ahead, so give it that much.
        proposals: What was considered, None if nothing is to be shown.
        braking: Whether this is an emergency brake.
    """

    poses: FloatArray
    proposals: Proposals | None = None
    braking: bool = False


@runtime_checkable
class Planner(Protocol):
    """Drives one scene; `start` comes once before the first `plan`."""

    def start(self, road: Road, body: EgoBody) -> None:
        """Get to know the map and the car; forget every drive before."""

    def plan(self, situation: Situation) -> Plan:
        """What to do from this moment on."""
