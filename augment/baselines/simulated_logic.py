"""Faults of logic, made on purpose: places and headings are right, or nobody can say of what."""

from __future__ import annotations

import math
import random
from dataclasses import replace

from augment.baselines.simulated_agents import (
    VEHICLES,
    free_id,
    is_thing,
    replace_agent,
    reverse_walk,
    walks,
)
from augment.baselines.simulated_road import (
    Agents,
    change_each,
    move_along,
    name_lane,
    new_contacts,
)
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.sizes import LENGTH_WIDTH_M

SEEN_SIDE_M = 0.5
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
    return made if off_m >= 2.0 * SEEN_SIDE_M else None


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
