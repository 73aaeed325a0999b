"""A human reference of interPlan in a sentence: its file has places, and no words.

Frame: the scene's ego frame. Only what interPlan's keys can hold comes up: vehicles and buses that
stand, cones, people.
"""

from __future__ import annotations

import math

from augment.scene.catalogue import ScenarioType
from augment.scene.entities import AgentType, Point, TrafficAgent
from augment.scene.modification import Modification

_STRAIGHT_DEG = 5.0
_BESIDE_M = 0.1
_LEADS = {
    ScenarioType.CONSTRUCTION_ZONE: "Put up a construction zone",
    ScenarioType.ACCIDENT_SITE: "Show the site of an accident",
    ScenarioType.JAYWALKER: "Let somebody cross the road outside a crosswalk",
    ScenarioType.NUDGE: "Have the ego nudge around what stands at the side of its lane",
    ScenarioType.OVERTAKE: "Have the ego overtake what stands in its lane",
}


def instruction_of(kind: ScenarioType, reference: Modification) -> str:
    """The sentences from which a reader could put the same objects to the same places."""
    cones = [agent for agent in reference.added if agent.type is AgentType.TRAFFIC_CONE]
    others = [agent for agent in reference.added if agent.type is not AgentType.TRAFFIC_CONE]
    parts = [_cones(cones)] if cones else []
    parts += [_thing(other, kind) for other in others]
    return f"{_LEADS[kind]}: {'; '.join(parts)}."


# Private


def _cones(cones: list[TrafficAgent]) -> str:
    ahead, left = [cone.x_m for cone in cones], [cone.y_m for cone in cones]
    if len(cones) == 1:
        return f"a traffic cone {_place((ahead[0], left[0]))}"
    first, last = (min(ahead), min(left)), (max(ahead), max(left))
    return f"{len(cones)} traffic cones in the area from {_place(first)} to {_place(last)}"


def _thing(agent: TrafficAgent, kind: ScenarioType) -> str:
    here = _place((agent.x_m, agent.y_m))
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m is not None:
            return f"a pedestrian who walks from {here} to {_place(agent.walk_to_m)}"
        who = "worker" if kind is ScenarioType.CONSTRUCTION_ZONE else "pedestrian"
        return f"a {who} who stands {here}"
    what = {AgentType.BUS: "bus"}.get(agent.type, "vehicle")
    how = "crashed" if kind is ScenarioType.ACCIDENT_SITE else "parked"
    return f"a {how} {what} {here}, {_turn(agent.heading_rad)}"


def _place(point: Point) -> str:
    x_m, y_m = point
    text = f"{abs(x_m):.1f} m {'ahead of' if x_m >= 0.0 else 'behind'} the ego"
    if abs(y_m) < _BESIDE_M:
        return text
    return f"{text} and {abs(y_m):.1f} m to its {'left' if y_m > 0.0 else 'right'}"


def _turn(heading_rad: float) -> str:
    degrees = math.degrees(heading_rad)
    if abs(degrees) < _STRAIGHT_DEG:
        return "in the ego's direction"
    side = "left" if degrees > 0.0 else "right"
    return f"turned {abs(degrees):.0f} degrees to the {side} of the ego's direction"
