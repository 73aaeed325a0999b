"""Faults made on purpose, each by its kind; the kind is the true label.

A kind applies where it makes a difference that a person would see, measured against the placement
before it; where it makes none it gives None. Nothing here looks at the checks.
"""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

from augment.checks.finding import FaultClass
from augment.fake_llm import careless
from augment.geometry.frames import difference, wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    LaneConnector,
    TrafficAgent,
    TrafficSide,
)
from bench.shifts import Agents, change_each, move_along, name_lane, new_contacts

VEHICLES = (AgentType.VEHICLE, AgentType.BUS)

SEEN_VEHICLE_DEG, SEEN_PERSON_DEG = 25.0, 45.0
"""From here on a wrong heading is seen; where a person looks is a rougher thing."""

_WALK_M = 3.0
"""Shorter walks are those of workers, who stand."""


def walks(agent: TrafficAgent) -> bool:
    """Whether it is a pedestrian with a walk of some length."""
    if agent.type is not AgentType.PEDESTRIAN or agent.walk_to_m is None:
        return False
    return math.dist((agent.x_m, agent.y_m), agent.walk_to_m) >= _WALK_M


def has_front(agent: TrafficAgent) -> bool:
    """Whether it has a front: cones have none, and workers look where they like."""
    return agent.type in VEHICLES or walks(agent)


def is_thing(agent: TrafficAgent) -> bool:
    """Whether it is no person."""
    return agent.type is not AgentType.PEDESTRIAN


def is_seen(before: Agents, after: Agents) -> bool:
    """Whether any heading has changed so that a person would see it."""
    return any(
        abs(difference(one.heading_rad, was.heading_rad))
        >= math.radians(SEEN_VEHICLE_DEG if was.type in VEHICLES else SEEN_PERSON_DEG)
        for one, was in zip(after, before, strict=True)
    )


def turn_agent(agent: TrafficAgent, turn_rad: float) -> TrafficAgent:
    """The agent with another heading; its walk stays."""
    return replace(agent, heading_rad=wrap(agent.heading_rad + turn_rad))


def reverse_walk(agent: TrafficAgent) -> TrafficAgent:
    """A walk from its end to its start."""
    assert agent.walk_to_m is not None
    x_m, y_m = agent.walk_to_m
    return replace(
        turn_agent(agent, math.pi),
        x_m=x_m,
        y_m=y_m,
        walk_to_m=(agent.x_m, agent.y_m),
        lane_id=None,
    )


def replace_agent(agents: Agents, old: TrafficAgent, new: TrafficAgent) -> Agents:
    """All of them, one exchanged for another."""
    return tuple(new if agent is old else agent for agent in agents)


def free_id(route: EgoRoute, agents: Agents) -> str:
    """An id that nobody has."""
    taken = {agent.id for agent in (*route.scene.everyone, *agents)}
    number = len(taken) + 1
    while f"Agent{number}" in taken:
        number += 1
    return f"Agent{number}"


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
    laid_out = careless.straight_line(agents, route, rng)
    made = change_each(laid_out, lambda agent: name_lane(route, agent))
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


SEEN_OFFSET_M = 0.5
"""What is nearer to the middle of its lane has no side that anybody would see."""

_OTHER_TYPES = {
    AgentType.VEHICLE: (AgentType.BICYCLE, AgentType.PEDESTRIAN),
    AgentType.BUS: (AgentType.VEHICLE, AgentType.BICYCLE),
    AgentType.PEDESTRIAN: (AgentType.BICYCLE, AgentType.TRAFFIC_CONE),
    AgentType.TRAFFIC_CONE: (AgentType.BARRIER, AgentType.GENERIC_OBJECT),
}
_EXTRA_TRIES = 8


def overlap(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """A later object of a kind on top of an earlier one; a single one is there twice."""
    kind = rng.choice([agent.type for agent in agents])
    same = [agent for agent in agents if agent.type is kind]
    if len(same) == 1:
        return (*agents, replace(same[0], id=free_id(route, agents)))
    number = rng.randrange(1, len(same))
    onto = same[number - 1]
    aside_m = rng.uniform(0.0, 0.1) * onto.length_m
    moved = replace(same[number], x_m=onto.x_m + aside_m, y_m=onto.y_m, walk_to_m=onto.walk_to_m)
    return replace_agent(agents, same[number], name_lane(route, moved))


def missing(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """One object less."""
    gone = rng.choice(agents)
    return tuple(agent for agent in agents if agent is not gone)


def extra(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """One more of what is there, some metres further or nearer, where there is room for it."""
    for _ in range(_EXTRA_TRIES):
        along_m = rng.choice((-1.0, 1.0)) * rng.uniform(4.0, 9.0)
        twin = replace(move_along(route, rng.choice(agents), along_m), id=free_id(route, agents))
        if not new_contacts(route.scene, agents, (*agents, twin)):
            return (*agents, twin)
    return None


def wrong_side(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """Left and right are exchanged: an offset, a line or a taper of cones, a walk."""
    if any(walks(agent) for agent in agents):
        return change_each(agents, lambda agent: reverse_walk(agent) if walks(agent) else agent)
    if sum(agent.type in VEHICLES for agent in agents) > 1:
        return None

    def mirrored(agent: TrafficAgent) -> TrafficAgent:
        return move_along(route, agent, 0.0, -2.0 * route.locate_agent(agent).left_m)

    made = change_each(agents, mirrored)
    # A ring or a row across the lane is its own mirror image, whoever stands where in it.
    things = [agent for agent in agents if is_thing(agent)]
    off_m = max(min(_apart_m(one, was) for was in things) for one in made if is_thing(one))
    return made if off_m >= 2.0 * SEEN_OFFSET_M else None


def _apart_m(one: TrafficAgent, other: TrafficAgent) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def wrong_type(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """One object is of another type, with the box of that type."""
    agent = rng.choice(agents)
    kind = rng.choice(_OTHER_TYPES.get(agent.type, (AgentType.GENERIC_OBJECT,)))
    length_m, width_m = LENGTH_WIDTH_M[kind]
    walk = agent.walk_to_m if kind is AgentType.PEDESTRIAN else None
    speed_mps = 0.0 if kind in (AgentType.TRAFFIC_CONE, AgentType.BARRIER) else agent.speed_mps
    return replace_agent(
        agents,
        agent,
        replace(
            agent,
            type=kind,
            length_m=length_m,
            width_m=width_m,
            walk_to_m=walk,
            speed_mps=speed_mps,
        ),
    )


def moving(route: EgoRoute, agents: Agents, rng: random.Random) -> Agents | None:
    """One of the vehicles that stand drives."""
    parked = [agent for agent in agents if agent.type in VEHICLES and agent.speed_mps == 0.0]
    if not parked:
        return None
    agent = rng.choice(parked)
    return replace_agent(agents, agent, replace(agent, speed_mps=round(rng.uniform(3.0, 12.0), 1)))


Maker = Callable[[EgoRoute, Agents, random.Random], Agents | None]

FAULTS: dict[FaultClass, dict[str, Maker]] = {
    FaultClass.POSITION: {
        "neighbour-lane": neighbour_lane,
        "straight-line": straight_line,
        "along-lane": along_lane,
        "off-road": off_road,
        "beyond-junction": beyond_junction,
    },
    FaultClass.HEADING: {
        "ego-heading": ego_heading,
        "flipped": flip_vehicle,
        "degrees-as-radians": degrees,
        "facing-away": facing_away,
    },
    FaultClass.LOGIC: {
        "overlap": overlap,
        "missing-object": missing,
        "extra-object": extra,
        "wrong-side": wrong_side,
        "wrong-type": wrong_type,
        "moving-parked": moving,
    },
}
"""What goes wrong in a placement, by its true label and its kind.

Each returns the agents with the fault, None where it makes no difference.
"""
MAKERS = {kind: maker for makers in FAULTS.values() for kind, maker in makers.items()}
LABELS = {kind: label for label, makers in FAULTS.items() for kind in makers}
