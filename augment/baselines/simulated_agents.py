"""What the faults made on purpose ask about agents, and how they change them."""

from __future__ import annotations

import math
from dataclasses import replace

from augment.baselines.simulated_road import Agents
from augment.geometry.angles import difference, wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, TrafficAgent

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
