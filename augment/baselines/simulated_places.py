"""Faults of position and of heading, made on purpose."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from itertools import pairwise

from augment.baselines.simulated_agents import (
    SEEN_VEHICLE_DEG,
    VEHICLES,
    has_front,
    is_seen,
    is_thing,
    replace_agent,
    turn_agent,
    walks,
)
from augment.baselines.simulated_road import Agents, change_each, move_along, name_lane
from augment.geometry.angles import difference, wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import LaneConnector, TrafficAgent, TrafficSide

SEEN_M = 3.0
"""A straight line instead of the lane is a fault from so many metres on."""
SEEN_SIDE_M = 1.0
"""Nearer to its mirror image than this a placement is told by nobody from it."""

_WIDEST_M = 60.0
_WALKWAY_M = 4.0

# Position: everything is anchored in the wrong place together, as a model does it.


def neighbour_lane(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """One lane to the left or right."""
    if any(walks(agent) for agent in agents):
        return None  # which lane a crossing pedestrian starts beside is nothing that is asked for
    left_m = rng.choice((-1.0, 1.0)) * route.graph.lane(route.lane_id).width_m
    things = [route.locate_agent(agent).left_m for agent in agents if is_thing(agent)]
    middle_m = sum(things) / len(things)
    if abs(2.0 * middle_m + left_m) < SEEN_SIDE_M:
        # From one boundary to the next is from one side of the lane to the other: a wrong side.
        left_m = -left_m
    return change_each(agents, lambda agent: move_along(route, agent, 0.0, left_m))


def straight_line(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """The distance laid out straight ahead of the ego instead of along its lane."""

    def laid_out(agent: TrafficAgent) -> TrafficAgent:
        place = route.locate_agent(agent)
        s_m, d_m = place.ahead_m, place.left_m
        walk = agent.walk_to_m
        if walk is not None:
            walk = (walk[0] + s_m - agent.x_m, walk[1] + d_m - agent.y_m)
        return name_lane(route, replace(agent, x_m=s_m, y_m=d_m, walk_to_m=walk))

    made = change_each(agents, laid_out)
    off_m = [_seen_m(route, was, one) for one, was in zip(made, agents, strict=True)]
    return made if min(off_m) >= SEEN_M else None


def _seen_m(route: EgoRoute, was: TrafficAgent, now: TrafficAgent) -> float:
    """How far something is off; of a walk across the road only what is along the road counts."""
    if walks(was):
        return abs(route.locate_agent(now).ahead_m - route.locate_agent(was).ahead_m)
    return math.hypot(now.x_m - was.x_m, now.y_m - was.y_m)


def along_lane(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """5 to 30 m too near or too far."""
    along_m = rng.choice((-1.0, 1.0)) * rng.uniform(5.0, 30.0)
    return change_each(agents, lambda agent: move_along(route, agent, along_m))


def off_road(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """Until no lane is under any of them, and some metres further: beside the ground of anybody.

    Towards the kerb; who crosses the road begins further out on its own side.
    """
    sign = 1.0 if route.scene.traffic_side is TrafficSide.LEFT else -1.0
    first = next((agent for agent in agents if walks(agent)), None)
    if first is not None:
        sign = math.copysign(1.0, route.locate_agent(first).left_m)
    far_m = 0.0
    while far_m < _WIDEST_M and any(
        route.graph.under(one.x_m, one.y_m) for one in _aside(route, agents, sign * far_m)
    ):
        far_m += 1.0
    beyond_m = rng.uniform(4.0, 10.0) + (_WALKWAY_M if first is not None else 0.0)
    return _aside(route, agents, sign * (far_m + beyond_m))


def _aside(route: EgoRoute, agents: Agents, left_m: float) -> Agents:
    return change_each(agents, lambda agent: move_along(route, agent, 0.0, left_m))


def _list_junction_ends(route: EgoRoute) -> list[float]:
    """How far ahead of the ego intersections end."""
    return [
        end_m
        for name, end_m in zip(route.lane_ids, route.ends_m, strict=True)
        if end_m > 0.0 and isinstance(route.graph.lane(name), LaneConnector)
    ]


def beyond_junction(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """On the far side of an intersection that lies ahead of where it belongs."""
    last_m = max(route.locate_agent(agent).ahead_m for agent in agents)
    first_m = min(route.locate_agent(agent).ahead_m for agent in agents)
    ends = [end for end in _list_junction_ends(route) if end > last_m]
    if not ends:
        return None
    along_m = ends[0] + rng.uniform(2.0, 8.0) - first_m
    if along_m < 5.0:
        return None
    return change_each(agents, lambda agent: move_along(route, agent, along_m))


# Heading: the place is right.


def ego_heading(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """The lane, the angle or the direction of a walk is ignored: everybody looks like the ego."""
    made = change_each(
        agents, lambda agent: replace(agent, heading_rad=0.0) if has_front(agent) else agent
    )
    cars = [agent for agent in agents if agent.type in VEHICLES]
    if len(cars) > 1:  # how crashed cars are turned against each other is what is seen
        turns = [
            abs(difference(one.heading_rad, other.heading_rad)) for one, other in pairwise(cars)
        ]
        return made if max(turns) >= math.radians(SEEN_VEHICLE_DEG) else None
    return made if is_seen(agents, made) else None


def flip_vehicle(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """The one vehicle looks the other way."""
    cars = [agent for agent in agents if agent.type in VEHICLES]
    if len(cars) != 1:
        return None  # a crash has no front
    return replace_agent(agents, cars[0], turn_agent(cars[0], math.pi))


def degrees(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """The number of degrees is given where radians are meant."""
    if sum(agent.type in VEHICLES for agent in agents) > 1:
        return None
    made = change_each(
        agents,
        lambda agent: (
            replace(agent, heading_rad=wrap(round(math.degrees(agent.heading_rad), 1)))
            if has_front(agent)
            else agent
        ),
    )
    return made if is_seen(agents, made) else None


def facing_away(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """Pedestrians look away from the road that they are to cross; half of them walk there."""
    if not any(walks(agent) for agent in agents):
        return None
    goes_there = rng.random() < 0.5

    def away(agent: TrafficAgent) -> TrafficAgent:
        if not walks(agent) or agent.walk_to_m is None:
            return agent
        end = agent.walk_to_m
        back = (2.0 * agent.x_m - end[0], 2.0 * agent.y_m - end[1]) if goes_there else end
        return replace(turn_agent(agent, math.pi), walk_to_m=back)

    return change_each(agents, away)
