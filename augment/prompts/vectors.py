"""A scene as the paper's table of input vectors: separate lists for each kind of entity.

Frame: ego frame, metres to two decimals, radians to three. Lanes are centrelines sampled every
5 m, or the control points of cubic Bezier pieces. Only what a wish can concern is written down
(`extent.py` has the rule).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from enum import StrEnum

import numpy as np

from augment.geometry.polyline import Polyline
from augment.prompts.clip import boundary_within, distance_to_area_m, simplify_boundary
from augment.prompts.extent import BESIDE_M, Extent, extent_of, shown_spans
from augment.prompts.lane_curves import control_points
from augment.prompts.names import ShortNames, number_of, short_names
from augment.scene.bezier_lanes import bezier_lane
from augment.scene.entities import (
    Area,
    Lane,
    LaneConnector,
    Modification,
    Scene,
    TrafficAgent,
    TrafficDensity,
    TurnType,
)

SPACING_M = 5.0
DEFAULT_RADIUS_M = 80.0

Vector = list[object]
Coordinates = Callable[[Polyline], list[object]]
"""How the shown part of a centreline is written down."""

_COMPASS = ("East", "Northeast", "North", "Northwest", "West", "Southwest", "South", "Southeast")
_BOUNDARY_TOLERANCE_M = 0.1
_WHOLE = re.compile(r"(?<=[0-9])\.0(?=[],])")
"""The end of a whole number; ids and words of ours have no dot."""


def polyline_coordinates(line: Polyline) -> list[object]:
    """Points every 5 m."""
    return [[_metres(x), _metres(y)] for x, y in line.resampled(SPACING_M).points_m]


def bezier_coordinates(line: Polyline) -> list[object]:
    """Pieces in order of travel, each four control points, or the two ends of a straight one."""
    return list(control_points(bezier_lane(line)))


class LaneFormat(StrEnum):
    """How a lane is written down: points every 5 m, or four control points of a cubic Bezier."""

    POLYLINE = "polyline"
    BEZIER = "bezier"


COORDINATES: dict[LaneFormat, Coordinates] = {
    LaneFormat.POLYLINE: polyline_coordinates,
    LaneFormat.BEZIER: bezier_coordinates,
}


def scene_text(
    scene: Scene, *, radius_m: float = DEFAULT_RADIUS_M, lanes: LaneFormat = LaneFormat.POLYLINE
) -> str:
    """The four lists under their headings, one entity a line, and what the lists can't say."""
    names, coordinates = short_names(scene), COORDINATES[lanes]
    lists = {
        "Agents": agent_vectors(scene, names, radius_m),
        "Lanes": lane_vectors(scene, names, radius_m, coordinates),
        "Lane connectors": connector_vectors(scene, names, radius_m, coordinates),
        "Areas": area_vectors(scene, names, radius_m),
    }
    parts = [f"{title}:\n{_listed(vectors)}" for title, vectors in lists.items()]
    parts.append(f"Traffic drives on the {scene.traffic_side.value}-hand side of the road.")
    parts += _options_lines(scene)
    parts.append(f"The first new agent is {names.next_agent}.")
    return "\n\n".join(parts)


def _options_lines(scene: Scene) -> list[str]:
    """What the scenario sets besides its change: the density of its traffic and its goal."""
    density, goal = scene.options.density, scene.options.goal
    lines = []
    if density is not TrafficDensity.NONE:
        lines.append(f"The traffic around the ego has a {density} density.")
    if goal is not None:
        way = "goes straight on" if goal is TurnType.STRAIGHT else f"turns {goal}"
        lines.append(f"The ego's goal: its way {way} where the lanes first part.")
    return lines


def changes_text(scene: Scene, modification: Modification) -> str:
    """What was added, moved and removed, as three lists under their headings."""
    names = short_names(scene)
    lists = {
        "Added agents": {agent.id: _walker_vector(agent, names) for agent in modification.added},
        "Moved agents": {
            names.agents[agent.id]: _walker_vector(agent, names) for agent in modification.moved
        },
    }
    parts = [f"{title}:\n{_listed(vectors)}" for title, vectors in lists.items()]
    removed = [names.agents[name] for name in modification.removed]
    return "\n\n".join([*parts, f"Removed agents:\n{json.dumps(removed)}"])


def agent_vectors(scene: Scene, names: ShortNames, radius_m: float) -> dict[str, Vector]:
    """Type, centre x and y, heading, width, length, velocity, lane id, by agent id."""
    return {
        names.agents[agent.id]: agent_vector(agent, names)
        for agent in shown_agents(scene, radius_m)
    }


def shown_agents(scene: Scene, radius_m: float) -> tuple[TrafficAgent, ...]:
    """The ego, and the agents with their centres in the region that is shown."""
    extent = extent_of(scene, radius_m)
    places = np.array([(agent.x_m, agent.y_m) for agent in scene.agents]).reshape(-1, 2)
    inside = extent.holds(places)
    return scene.ego, *(agent for agent, is_in in zip(scene.agents, inside, strict=True) if is_in)


def agent_vector(agent: TrafficAgent, names: ShortNames) -> Vector:
    """One agent as its list of attributes."""
    return [
        agent.type.value,
        _metres(agent.x_m),
        _metres(agent.y_m),
        round(agent.heading_rad, 3) + 0.0,
        _metres(agent.width_m),
        _metres(agent.length_m),
        _metres(agent.speed_mps),
        None if agent.lane_id is None else names.lanes.get(agent.lane_id),
    ]


def lane_vectors(
    scene: Scene,
    names: ShortNames,
    radius_m: float,
    coordinates: Coordinates = polyline_coordinates,
) -> dict[str, Vector]:
    """Lane number, travel direction, direction relative to the ego, width, limit, coordinates."""
    spans = shown_spans(scene, radius_m)
    return {
        names.lanes[lane.id]: _lane_vector(
            lane, lane.centerline.between(*spans[lane.id]), names, coordinates
        )
        for lane in scene.lanes
        if lane.id in spans
    }


def connector_vectors(
    scene: Scene,
    names: ShortNames,
    radius_m: float,
    coordinates: Coordinates = polyline_coordinates,
) -> dict[str, Vector]:
    """From lane, to lane, light, turn, width, speed limit, coordinates, by connector id."""
    spans = shown_spans(scene, radius_m)
    return {
        names.lanes[lane.id]: _connector_vector(
            lane, lane.centerline.between(*spans[lane.id]), names, coordinates
        )
        for lane in scene.connectors
        if lane.id in spans
    }


def area_vectors(scene: Scene, names: ShortNames, radius_m: float) -> dict[str, Vector]:
    """Kind and boundary points, by area id."""
    extent = extent_of(scene, radius_m)
    cut = ((area, _boundary(area, extent)) for area in scene.areas)
    return {names.areas[area.id]: [area.kind.value, points] for area, points in cut if points}


def compass(heading_rad: float) -> str:
    """The travel direction in words; +x is East, +y is North."""
    return _COMPASS[round(heading_rad / (math.pi / 4.0)) % 8] + "wards"


def relative_direction(heading_rad: float) -> str:
    """The direction relative to the ego, which faces 0: within 45 degrees it is the same."""
    turn = abs(math.remainder(heading_rad, 2.0 * math.pi))
    if turn <= math.pi / 4.0:
        return "same"
    return "opposite" if turn >= 3.0 * math.pi / 4.0 else "crossing"


def _walker_vector(agent: TrafficAgent, names: ShortNames) -> Vector:
    """An agent's vector, with the end of its walk if it walks."""
    walk: Vector = [] if agent.walk_to_m is None else [[_metres(v) for v in agent.walk_to_m]]
    return agent_vector(agent, names) + walk


def _lane_vector(
    lane: Lane, line: Polyline, names: ShortNames, coordinates: Coordinates
) -> Vector:
    heading_rad = line.heading_at(line.project(0.0, 0.0).s_m)
    return [
        number_of(names.lanes[lane.id]),
        compass(heading_rad),
        relative_direction(heading_rad),
        _metres(lane.width_m),
        _speed_limit(lane.speed_limit_mps),
        coordinates(line),
    ]


def _connector_vector(
    lane: LaneConnector, line: Polyline, names: ShortNames, coordinates: Coordinates
) -> Vector:
    return [
        None if lane.from_lane is None else names.lanes.get(lane.from_lane),
        None if lane.to_lane is None else names.lanes.get(lane.to_lane),
        lane.traffic_light.value,
        lane.turn_type.value,
        _metres(lane.width_m),
        _speed_limit(lane.speed_limit_mps),
        coordinates(line),
    ]


def _boundary(area: Area, extent: Extent) -> list[list[float]]:
    points = boundary_within(np.array(area.boundary_m, dtype=np.float64), extent.box_m)
    if len(points) < 3:
        return []
    routes = extent.routes_m
    if routes is not None and distance_to_area_m(points, routes) > BESIDE_M:
        return []
    return [[_metres(x), _metres(y)] for x, y in simplify_boundary(points, _BOUNDARY_TOLERANCE_M)]


def _speed_limit(limit_mps: float | None) -> float | None:
    return None if limit_mps is None else _metres(limit_mps)


def _metres(value: float) -> float:
    return round(float(value), 2) + 0.0


def _listed(vectors: Mapping[str, Vector]) -> str:
    # A blank before a number is a token of its own to most models, so coordinates have none.
    lines = [f"{json.dumps(name)}: {_vector_text(vector)}" for name, vector in vectors.items()]
    return "{" + ",\n ".join(lines) + "}"


def _vector_text(vector: Vector) -> str:
    return _WHOLE.sub("", json.dumps(vector, separators=(",", ":")))
