"""Agents moved by the ego's route, and placements that are right but not exact.

Frame: ego frame. Nothing here looks at the checks.
"""

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from augment.fake_llm.careless import shift_agent
from augment.geometry.frames import Box, overlap, wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Modification, Scene, TrafficAgent

Agents = tuple[TrafficAgent, ...]

ALONG_M = 1.5
"""How far along the lane a right placement may be off its reference."""
ACROSS_M = 0.3
TURN_DEG = 5.0
OWN_M = 0.1
"""How far one of several objects may be off the others, either way."""

_TRIES = 20
_TOUCH_M = 0.01


def move_along(
    route: EgoRoute, agent: TrafficAgent, along_m: float, left_m: float = 0.0
) -> TrafficAgent:
    """The agent elsewhere by the route, turned as the route turns, its walk too."""
    moved = shift_agent(agent, route, along_m, left_m)
    if agent.walk_to_m is not None:
        ((x_m, y_m),) = moved.pose.to_parent(agent.pose.to_local(np.array([agent.walk_to_m])))
        moved = replace(moved, walk_to_m=(float(x_m), float(y_m)))
    return name_lane(route, moved)


def name_lane(route: EgoRoute, agent: TrafficAgent) -> TrafficAgent:
    """The agent with the lane under it, if it named one at all."""
    if agent.lane_id is None:
        return agent
    return replace(agent, lane_id=route.graph.under(agent.x_m, agent.y_m, agent.heading_rad))


def jitter(route: EgoRoute, reference: Modification, rng: random.Random) -> Modification:
    """A right placement that is not exact: all shifted together, each a little on its own.

    What did not touch before does not touch now; where chance finds no such place, the shift
    shrinks until it is the reference again.
    """
    for number in range(_TRIES):
        scale = 1.0 - number / _TRIES
        along, left = rng.uniform(-ALONG_M, ALONG_M), rng.uniform(-ACROSS_M, ACROSS_M)
        moved = tuple(
            _shaken(move_along(route, agent, scale * along, scale * left), scale, rng)
            for agent in reference.added
        )
        if not new_contacts(route.scene, reference.added, moved):
            return replace(reference, added=moved)
    return reference


def new_contacts(scene: Scene, before: Agents, after: Agents) -> bool:
    """Whether boxes overlap after that did not before."""
    return len(_contacts(scene, after)) > len(_contacts(scene, before))


def change_each(
    agents: Iterable[TrafficAgent], change: Callable[[TrafficAgent], TrafficAgent]
) -> Agents:
    """Every agent changed."""
    return tuple(change(agent) for agent in agents)


# Private


def _shaken(agent: TrafficAgent, scale: float, rng: random.Random) -> TrafficAgent:
    """On its own: a hand's breadth in place and a few degrees, the end of a walk half a metre."""
    turn = math.radians(scale * rng.uniform(-TURN_DEG, TURN_DEG))
    dx, dy = (scale * rng.uniform(-OWN_M, OWN_M) for _ in range(2))
    walk = agent.walk_to_m
    if walk is not None:
        walk = (walk[0] + dx + scale * rng.uniform(-0.5, 0.5), walk[1] + dy)
    return replace(
        agent,
        x_m=agent.x_m + dx,
        y_m=agent.y_m + dy,
        heading_rad=wrap(agent.heading_rad + turn),
        walk_to_m=walk,
    )


def _contacts(scene: Scene, agents: Agents) -> list[tuple[int, int]]:
    boxes = [agent.box for agent in (*agents, *scene.everyone)]
    return [
        (n, m)
        for n in range(len(agents))
        for m in range(n + 1, len(boxes))
        if _near(boxes[n], boxes[m]) and overlap(boxes[n], boxes[m]).depth_m > _TOUCH_M
    ]


def _near(one: Box, other: Box) -> bool:
    reach = math.hypot(one.length_m, one.width_m) + math.hypot(other.length_m, other.width_m)
    return math.hypot(one.pose.x_m - other.pose.x_m, one.pose.y_m - other.pose.y_m) < reach / 2.0
