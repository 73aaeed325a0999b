"""One modification on one ground: what every check that needs no intent looks at."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from augment.checks.finding import Finding
from augment.checks.ground import Beside, Ground, best_aligned, gaps_m
from augment.geometry.frames import Box
from augment.scene.entities import AgentType, Modification, TrafficAgent, apply

VEHICLES = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.EGO_VEHICLE})
STOPPED_BELOW_MPS = 0.5
CRASH_GAP_M = 1.5
"""Between cars of one accident; those placed by hand for interPlan are up to 1.43 m apart."""

_SMALLEST_M = 0.01
"""A side below this is taken as this: a smaller box has no area that could be shared."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ChangedScene:
    """A scene after its change, with what several checks need worked out once.

    Attributes:
        ground: The scene before the change.
        changed: The added and the moved agents, which the findings are about.
        everyone: All agents after the change, the ego first.
    """

    ground: Ground
    changed: tuple[TrafficAgent, ...]
    everyone: tuple[TrafficAgent, ...]

    @classmethod
    def of(cls, ground: Ground, modification: Modification) -> ChangedScene:
        """Return the modification on its ground.

        Raises:
            InvalidModification: It does not fit the scene.
        """
        after = apply(ground.scene, modification)
        return cls(ground=ground, changed=modification.changed, everyone=after.everyone)

    @cached_property
    def boxes(self) -> dict[str, Box]:
        """Everybody's box, by id."""
        return {
            agent.id: replace(
                agent.box,
                length_m=max(agent.length_m, _SMALLEST_M),
                width_m=max(agent.width_m, _SMALLEST_M),
            )
            for agent in self.everyone
        }

    @cached_property
    def beside(self) -> dict[str, tuple[Beside, ...]]:
        """Each changed agent's centre beside every lane, by id."""
        lanes = self.ground.lanes
        return {agent.id: lanes.beside(agent.x_m, agent.y_m) for agent in self.changed}

    def under(self, agent: TrafficAgent) -> Beside | None:
        """Return the lane under a changed agent; of several the one that fits its heading."""
        return best_aligned(self.beside[agent.id], agent.heading_rad)

    def nearest(self, agent: TrafficAgent) -> Beside | None:
        """Return the lane whose edge is nearest to a changed agent, None without lanes."""
        return min(
            self.beside[agent.id],
            key=lambda one: (round(one.off_m, 4), round(one.distance_m, 4)),
            default=None,
        )

    def new_pairs(self) -> Iterator[tuple[TrafficAgent, TrafficAgent]]:
        """Yield every pair with a changed agent in it, that one first, each once."""
        done: set[str] = set()
        for agent in self.changed:
            done.add(agent.id)
            for other in self.everyone:
                if other.id not in done:
                    yield agent, other

    @cached_property
    def crashed(self) -> frozenset[str]:
        """Changed vehicles that stand so close to another changed one that they look crashed."""
        cars = [agent for agent in self.changed if agent.type in VEHICLES and is_stopped(agent)]
        if len(cars) < 2:
            return frozenset()
        gaps = gaps_m(np.array([self.boxes[car.id].corners_m for car in cars]))
        np.fill_diagonal(gaps, np.inf)
        near = gaps.min(axis=1) <= CRASH_GAP_M
        return frozenset(car.id for car, is_near in zip(cars, near, strict=True) if is_near)


Check = Callable[[ChangedScene], Iterator[Finding]]
"""A check yields what it measured, and nothing where there is nothing to measure."""


def is_stopped(agent: TrafficAgent) -> bool:
    """Return whether an agent stands."""
    return abs(agent.speed_mps) < STOPPED_BELOW_MPS
