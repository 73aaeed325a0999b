"""A scene as the paper's table of input vectors: separate lists for each kind of entity.

Frame: ego frame, metres to two decimals, radians to three. Lanes are centrelines sampled every
5 m, or the control points of cubic Bezier pieces. Only what a wish can concern is written down
(`extent.py` has the rule).

Scenes come from files of other people: a name out of such a file could carry a sentence, so
nothing but our own words, numbers and short ids such as Lane3 reaches a prompt. What is written
into a prompt and what the pose tool answers about both come from `lane_curves`, so that "the
beginning of Lane3" and its control points are the same place in either.
"""

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from functools import cached_property, lru_cache
from itertools import count
from string import ascii_letters
from typing import Any, TypeVar

import numpy as np

from augment.geometry.bezier import CubicBezier, travel_pose
from augment.geometry.frames import Pose
from augment.geometry.polyline import Projection
from augment.prompts.extent import boundary_near, find_extent, find_spans
from augment.scene import entities
from augment.scene.bezier_lanes import LanePiece, bezier_lane, piece_ids, straight_curve
from augment.scene.codec import intent_to_parts
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import AtPlace, LanePath, PlannedMotion

SPACING_M = 5.0
DEFAULT_RADIUS_M = 80.0
_MOST_BOXES = 6

Vector = list[object]
Renamed = TypeVar("Renamed")

_COMPASS = ("East", "Northeast", "North", "Northwest", "West", "Southwest", "South", "Southeast")
_BOUNDARY_TOLERANCE_M = 0.1
_WITH_IDS = (
    *(entities.Scene, entities.Modification, entities.TrafficAgent),
    *(entities.Lane, entities.LaneConnector, PlannedMotion, LanePath, AtPlace),
)
_OF_AGENTS = frozenset({"agent_id", "removed"})
_OF_LANES = frozenset({"lane_id", "lane_ids", "left_neighbor", "right_neighbor"}) | frozenset(
    {"successors", "from_lane", "to_lane"}
)
"""Fields that name agents, or lanes and connectors, besides the `id` of each."""
# The end of a whole number; ids and words of ours have no dot.
_WHOLE = re.compile(r"(?<=[0-9])\.0(?=[],}])")


class LaneFormat(StrEnum):
    """Notation of a lane: points every 5 m, or four control points of a cubic Bezier."""

    POLYLINE = "polyline"
    BEZIER = "bezier"


@dataclass(frozen=True)
class ShortNames:
    """Ids of a scene and their short forms, such as Agent2, Lane3, Connector1, Area4.

    Attributes:
        agents, lanes, areas: Short form by the scene's own id; lanes are lanes and connectors.
    """

    agents: dict[str, str]
    lanes: dict[str, str]
    areas: dict[str, str]

    @cached_property
    def agent_ids(self) -> dict[str, str]:
        """The scene's agent id by short form."""
        return {short: name for name, short in self.agents.items()}

    @cached_property
    def lane_ids(self) -> dict[str, str]:
        """The scene's lane or connector id by short form."""
        return {short: name for name, short in self.lanes.items()}

    @property
    def next_agent(self) -> str:
        """The id that the first new agent should get."""
        return f"Agent{1 + max(_parse_number(short) for short in self.agents.values())}"


def short_names(scene: entities.Scene) -> ShortNames:
    """Return the short forms for everything in the scene; ids that are short already stay."""
    return ShortNames(
        agents=_shorten((agent.id for agent in scene.everyone), "Agent"),
        lanes=_shorten((lane.id for lane in scene.lanes), "Lane")
        | _shorten((connector.id for connector in scene.connectors), "Connector"),
        areas=_shorten((area.id for area in scene.areas), "Area"),
    )


def with_short_ids(value: Renamed, names: ShortNames) -> Renamed:
    """Return a scene, a part of one or a change with short ids in the place of the scene's own."""
    renamed: Renamed = _rename(value, names.agents, names.lanes)
    return renamed


def with_scene_ids(value: Renamed, names: ShortNames) -> Renamed:
    """Return the document with the scene's own ids for short ones; ids that are new to it stay."""
    renamed: Renamed = _rename(value, names.agent_ids, names.lane_ids)
    return renamed


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneCurve:
    """One lane or connector as far as it is shown.

    The prompt shows the Bezier pieces; the tool reads the recorded centreline itself.

    Attributes:
        id: Its short id.
        lane: Its pieces; s = 0 is where the shown part begins.
        whole: The whole of it, as recorded.
        begins_m: Where on its centreline the shown part begins.
        before, after: Short ids of what joins it within the shown map, straightest first.
    """

    id: str
    lane: tuple[LanePiece, ...]
    whole: entities.AnyLane
    begins_m: float
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def width_m(self) -> float:
        """Width of the lane in m."""
        return self.whole.width_m

    @property
    def length_m(self) -> float:
        """Length of the shown part in m."""
        return self.lane[-1].end_m

    def pose_at(self, s_m: float, d_m: float = 0.0) -> Pose:
        """Return the place on the recorded centreline at s of the shown part, d to the left."""
        return travel_pose(self.whole.centerline, self.begins_m + s_m, d_m)

    def project(self, x_m: float, y_m: float) -> Projection:
        """Return the nearest place on the recorded centreline of the shown part."""
        shown = self.whole.centerline.between(self.begins_m, self.begins_m + self.length_m)
        return shown.project(x_m, y_m)

    @property
    def pieces(self) -> tuple[str, ...]:
        """Names of its pieces, in order of travel."""
        return piece_ids(self.id, len(self.lane))


def lane_curves(scene: entities.Scene, names: ShortNames, radius_m: float) -> dict[str, LaneCurve]:
    """Return all lanes and connectors that a prompt shows, by short id, in the scene's order."""
    graph = LaneGraph(scene)
    spans = find_spans(scene, radius_m)
    begins = {key for key, (start_m, _) in spans.items() if start_m < 1e-6}
    ends = {
        key
        for key, (_, end_m) in spans.items()
        if end_m > graph.lanes[key].centerline.length_m - 1e-6
    }

    def shown(ids: Iterable[str], among: set[str]) -> tuple[str, ...]:
        return tuple(names.lanes[lane_id] for lane_id in ids if lane_id in among)

    return {
        names.lanes[key]: LaneCurve(
            id=names.lanes[key],
            lane=bezier_lane(graph.lanes[key].centerline.between(*span)),
            whole=graph.lanes[key],
            begins_m=span[0],
            before=shown(graph.predecessors(key) if key in begins else (), ends),
            after=shown(graph.successors(key) if key in ends else (), begins),
        )
        for key, span in spans.items()
    }


def control_points(lane: Iterable[LanePiece]) -> list[list[list[float]]]:
    """Return the control points [x, y] of each piece, to the centimetre, ready for JSON.

    Four, or of a straight piece its two ends.
    """
    return [
        np.add(np.round(piece.curve.control_m[:: 3 if piece.is_straight else 1], 2), 0.0).tolist()
        for piece in lane
    ]


def curve_from(points: Sequence[Sequence[float]]) -> CubicBezier:
    """Return the curve of four control points, or of the two ends of a straight piece.

    Raises:
        ValueError: They are neither, or no curve.
    """
    return straight_curve(*points) if len(points) == 2 else CubicBezier(points)


_DRIVEN_BY_RULES = (
    "Without a motion, whatever is said elsewhere, who moves on a lane follows it at the speed "
    "limit, behind who is ahead, and stops at red; who walks is there once the ego is within 50 m "
    "along its lane, and takes 15 s for the way and as long again as that took."
)


@lru_cache(maxsize=16)
def scene_text(
    scene: entities.Scene,
    *,
    radius_m: float = DEFAULT_RADIUS_M,
    lanes: LaneFormat = LaneFormat.POLYLINE,
) -> str:
    """Write the four lists under their headings, and what the lists can't say."""
    names, density, goal = short_names(scene), scene.options.density, scene.options.goal
    parts = [_list_text(*entry) for entry in scene_vectors(scene, radius_m, lanes).items()]
    parts.append(f"Traffic drives on the {scene.traffic_side.value}-hand side of the road.")
    if density is not entities.TrafficDensity.NONE:
        parts.append(f"The traffic around the ego has a {density} density.")
    if goal is not None:
        way = "goes straight on" if goal is entities.TurnType.STRAIGHT else f"turns {goal}"
        parts.append(f"The ego's goal: its way {way} where the lanes first part.")
    rules = scene.options.interplan
    if rules is not None and rules.boxes_m is not None:
        boxes_m = [
            f"{wide:g} x {long:g}"
            for long, wide in (*rules.boxes_m, scene.ego.size_m)[:_MOST_BOXES]
        ]
        order = (
            f"in their order {', '.join(boxes_m)} m (width x length), whatever is said elsewhere"
        )
        parts.append(f"New agents of type VEHICLE are {order}.")
    if rules is not None:
        parts.append(_DRIVEN_BY_RULES)
    parts.append(f"The first new agent is {names.next_agent}.")
    return "\n\n".join(parts)


def changes_text(scene: entities.Scene, modification: entities.Modification) -> str:
    """Write what was added, moved and removed, as three lists under their headings."""
    names = short_names(scene)
    added = {agent.id: _agent_vector(agent, names) for agent in modification.added}
    moved = {names.agents[agent.id]: _agent_vector(agent, names) for agent in modification.moved}
    removed = [names.agents[name] for name in modification.removed]
    return "\n\n".join(
        [
            _list_text("Added agents", added),
            _list_text("Moved agents", moved),
            f"Removed agents:\n{json.dumps(removed)}",
        ]
    )


def scene_vectors(
    scene: entities.Scene, radius_m: float, lanes: LaneFormat = LaneFormat.POLYLINE
) -> dict[str, dict[str, Vector]]:
    """Return the four lists by heading: each entity's attributes by its short id.

    Agents: type, centre x and y, heading, width, length, velocity, lane, and of those that have
    one the end of a walk or a motion. Lanes: number, travel
    direction, direction relative to the ego, width, limit, coordinates. Lane connectors: from,
    to, light, turn, width, limit, coordinates. Areas: kind and boundary.
    """
    names, spans = short_names(scene), find_spans(scene, radius_m)
    road: dict[str, dict[str, Vector]] = {"Lanes": {}, "Lane connectors": {}}
    for lane in scene.ways:
        if lane.id not in spans:
            continue
        line = lane.centerline.between(*spans[lane.id])
        short = names.lanes[lane.id]
        facts: Vector
        if isinstance(lane, entities.Lane):
            kind, heading_rad = "Lanes", line.heading_at(line.project(0.0, 0.0).s_m)
            facts = [_parse_number(short), compass(heading_rad), _relative(heading_rad)]
        else:
            kind = "Lane connectors"
            ends = (names.lanes.get(end or "") for end in (lane.from_lane, lane.to_lane))
            facts = [*ends, lane.traffic_light.value, lane.turn_type.value]
        limit_mps = None if lane.speed_limit_mps is None else _metres(lane.speed_limit_mps)
        coordinates: object = _points(line.resample(SPACING_M).points_m)
        if lanes is LaneFormat.BEZIER:
            coordinates = control_points(bezier_lane(line))
        road[kind][short] = [*facts, _metres(lane.width_m), limit_mps, coordinates]
    extent = find_extent(scene, radius_m)
    areas: dict[str, Vector] = {
        names.areas[area.id]: [area.kind.value, _points(boundary)]
        for area in scene.areas
        if len(boundary := boundary_near(area, extent, _BOUNDARY_TOLERANCE_M))
    }
    shown = list_agents(scene, radius_m)
    agents = {names.agents[agent.id]: _agent_vector(agent, names) for agent in shown}
    return {"Agents": agents, **road, "Areas": areas}


def list_agents(scene: entities.Scene, radius_m: float) -> tuple[entities.TrafficAgent, ...]:
    """Return the ego, and the agents with their centres in the region that is shown."""
    places = np.array([(agent.x_m, agent.y_m) for agent in scene.agents]).reshape(-1, 2)
    inside = find_extent(scene, radius_m).holds(places)
    return scene.ego, *(agent for agent, is_in in zip(scene.agents, inside, strict=True) if is_in)


def compass(heading_rad: float) -> str:
    """Return the travel direction in words; +x is East, +y is North."""
    return _COMPASS[round(heading_rad / (math.pi / 4.0)) % 8] + "wards"


# Private


def _shorten(ids: Iterable[str], prefix: str) -> dict[str, str]:
    names = list(ids)
    valid = {name for name in names if re.fullmatch(prefix + "[1-9][0-9]{0,4}", name, re.ASCII)}
    free = (f"{prefix}{number}" for number in count(1))
    fresh = (name for name in free if name not in valid)
    return {name: name if name in valid else next(fresh) for name in names}


def _parse_number(short: str) -> int:
    return int(short.lstrip(ascii_letters))


def _relative(heading_rad: float) -> str:
    """Return the direction relative to the ego, which faces 0; up to 45 degrees is the same."""
    turn = abs(math.remainder(heading_rad, 2.0 * math.pi))
    if turn <= math.pi / 4.0:
        return "same"
    return "opposite" if turn >= 3.0 * math.pi / 4.0 else "crossing"


def _rename(value: Any, agents: Mapping[str, str], lanes: Mapping[str, str]) -> Any:
    if isinstance(value, tuple):
        return tuple(_rename(part, agents, lanes) for part in value)
    if not isinstance(value, _WITH_IDS):
        return value
    changes = {}
    for part in fields(value):
        value_before, is_lane = getattr(value, part.name), isinstance(value, entities.AnyLane)
        if part.name in _OF_LANES or (part.name == "id" and is_lane):
            changes[part.name] = _lookup_name(value_before, lanes)
        elif part.name in _OF_AGENTS or part.name == "id":
            changes[part.name] = _lookup_name(value_before, agents)
        else:
            changes[part.name] = _rename(value_before, agents, lanes)
    return replace(value, **changes)


def _lookup_name(value: str | tuple[str, ...] | None, names: Mapping[str, str]) -> Any:
    if isinstance(value, tuple):
        return tuple(names.get(name, name) for name in value)
    return value and names.get(value, value)


def motion_parts(motion: PlannedMotion) -> dict[str, object]:
    """Return a motion as it stands in lists and answers, to the centimetre."""
    parts: dict[str, object] = _round(intent_to_parts(motion))
    return parts


def _round(part: Any) -> Any:
    if isinstance(part, dict):
        return {name: _round(value) for name, value in part.items()}
    if isinstance(part, list):
        return [_round(value) for value in part]
    return _metres(part) if isinstance(part, float) else part


def _agent_vector(agent: entities.TrafficAgent, names: ShortNames) -> Vector:
    """Return an agent's attributes, at the end where its walk ends, or its motion."""
    last: Vector = []
    if agent.motion is not None:
        last = [motion_parts(with_short_ids(agent.motion, names))]
    elif agent.walk_to_m is not None:
        last = [[_metres(value) for value in agent.walk_to_m]]
    return [
        agent.type.value,
        _metres(agent.x_m),
        _metres(agent.y_m),
        round(agent.heading_rad, 3) + 0.0,
        _metres(agent.width_m),
        _metres(agent.length_m),
        _metres(agent.speed_mps),
        names.lanes.get(agent.lane_id or ""),
        *last,
    ]


def _points(points_m: Iterable[Sequence[float]]) -> list[list[float]]:
    return [[_metres(x), _metres(y)] for x, y in points_m]


def _metres(value: float) -> float:
    return round(float(value), 2) + 0.0


def _list_text(title: str, vectors: Mapping[str, Vector]) -> str:
    # A blank before a number is a token of its own to most models, so coordinates have none.
    lines = [
        f"{json.dumps(name)}: {_WHOLE.sub('', json.dumps(vector, separators=(',', ':')))}"
        for name, vector in vectors.items()
    ]
    return f"{title}:\n" + "{" + ",\n ".join(lines) + "}"
