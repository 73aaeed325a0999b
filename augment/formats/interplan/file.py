"""interPlan's modification file: its typed shape, its special scenarios as changes, its text.

Frames: the file is in the global frame, which is the one that a scene's origin is given in;
changes are in their scene's ego frame. Metres and radians; positions are centres of boxes. Keys
that nobody knows are kept aside, so that a reader can say that they say nothing here.
"""

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, TypeVar

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.checks.ground import Ground
from augment.errors import InvalidDocument
from augment.escaping import escape_controls
from augment.geometry.frames import wrap
from augment.scene.density import ExtraAgent, spawn_traffic
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Modification,
    Point,
    ScenarioType,
    Scene,
    SceneOptions,
    TrafficAgent,
    TrafficDensity,
    TurnType,
)
from augment.scene.schema import path, problems_of

WHAT = "interPlan file"
OBJECTS = ("stopped_vehicle", "stopped_bus", "cones", "pedestrian")
"""The keys of a special scenario whose rows a change writes anew."""
STANDING_WALK_M: Final = 1.5
"""A walk up to here is a worker's: interPlan's construction workers step 1.0 m."""
WALK_S: Final = 15.0
"""How long a walk takes after its activation, whatever its length."""
MOST_ENTRIES: Final = 100
"""The index of a special scenario has at most two digits."""
FURTHEST_FROM_EGO_M = 1_000.0
"""What lies further from its scene's ego is in another frame, or another scene is meant."""
_STANDS_M = 0.01

_Item = TypeVar("_Item")
_Objects = Annotated[list[_Item], Field(max_length=1_000, fail_fast=True)]
_Metres = Annotated[float, Field(ge=-1e8, le=1e8)]
_Standing = Annotated[
    tuple[_Metres, _Metres, Annotated[float, Field(ge=-100.0, le=100.0)]], Strict(False)
]
_Place = Annotated[tuple[_Metres, _Metres], Strict(False)]
_Iteration = Annotated[int, Field(ge=0, le=1_000_000)]
_Walk = Annotated[tuple[_Metres, _Metres, _Metres, _Metres, _Iteration | None], Strict(False)]
_GoalPlace = Annotated[str, Field(pattern=r"^\s*-?\d{1,9}(\.\d+)?\s*,\s*-?\d{1,9}(\.\d+)?\s*$")]
_Token = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
_Index = Annotated[str, Field(pattern=r"^[0-9]{1,2}$")]
_Config = Annotated[str, Field(pattern=r"^(d[lmh]|g[lrs]|o[amc]|a\d|s\d{1,2})*$")]
"""Density, goal, observation, amount of agents and special scenario, as one suffix."""


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, frozen=True)


class SpecialScenario(_Part):
    """One special scenario."""

    type: Annotated[ScenarioType, Strict(False)]
    config: _Config | None = None
    stopped_vehicle: _Objects[_Standing] = []
    stopped_bus: _Objects[_Standing] = []
    cones: _Objects[_Place] = []
    pedestrian: _Objects[_Walk] = []
    roadblock_locations_to_spawn_agents: _Objects[_Place] | None = None


class Details(_Part):
    """What stands under one base token.

    Attributes:
        extra_agents_to_spawn: Rows of x, y and speed, and perhaps how the vehicle behaves.
        goal: "x, y" by turn; None where the turn alone is said.
    """

    extra_agents_to_spawn: _Objects[Annotated[list[Any], Field(min_length=3)]] | None = None
    roadblock_locations_to_spawn_agents: _Objects[_Place] | None = None
    goal: dict[str, _GoalPlace | None] | None = None
    spawn_in_intersection: bool | None = None
    special_scenario: dict[_Index, SpecialScenario] | None = None


class File(_Part):
    """The whole file; in the published one the two accelerations refer to another: "${...}"."""

    accel_max: float | str | None = None
    decel_max: float | str | None = None
    scenario_specifics: Any = None
    modification_details_dictionary: dict[_Token, Details]


@dataclass(frozen=True, slots=True, kw_only=True)
class InterplanSource:
    """Where a scenario comes from in nuPlan and in interPlan's file, whose parts stay verbatim.

    Attributes:
        token: The base token: nuPlan's lidar_pc of t0.
        index: Of the special scenario; None for one that is in no file of interPlan's.
        entry: The special scenario.
        details: What stands beside the special scenarios under the token.
        file: What stands beside the tokens.
    """

    token: str
    index: str | None = None
    entry: Mapping[str, Any] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)
    file: Mapping[str, Any] = field(default_factory=dict)


# Reading


def file_of(document: object) -> File:
    """Return the document in its typed shape.

    Raises:
        InvalidDocument: It is not interPlan's, with the path and the reason of every fault, or
            it holds no special scenario.
    """
    if not isinstance(document, dict):
        kind = type(document).__name__
        problem = f"expected a mapping with interPlan's keys, got {kind}"
        raise InvalidDocument(WHAT, [("", problem)])
    try:
        file = File.model_validate(document)
    except ValidationError as fault:
        raise InvalidDocument(WHAT, problems_of(fault)) from None
    if not any(one.special_scenario for one in file.modification_details_dictionary.values()):
        raise InvalidDocument(WHAT, [("", "holds no special scenario")])
    return file


def place_of(token: str, index: str | int, *steps: str | int) -> str:
    """Return where in a file a part of a special scenario stands."""
    return path("modification_details_dictionary", token, "special_scenario", str(index), *steps)


def read_entry(
    token: str, index: str | int, entry: SpecialScenario, scene: Scene
) -> tuple[Modification, list[str]]:
    """Return a special scenario as a change: vehicles, buses, cones, pedestrians.

    Boxes get our own usual sizes, cones the direction of the ego's way.

    Args:
        token: The base token.
        index: Of the special scenario.
        entry: The special scenario.
        scene: In the file's frame, without the traffic that interPlan removes.

    Returns:
        The change, and what of the special scenario it can't say.

    Raises:
        InvalidDocument: An object is nowhere near the scene.
    """
    ground, left_out = Ground.of(scene), list[str]()
    added: list[TrafficAgent] = []

    def place(x_m: float, y_m: float, key: str, number: int) -> Point:
        x_m, y_m = _to_local(scene, x_m, y_m)
        away_m = math.hypot(x_m, y_m)
        if away_m > FURTHEST_FROM_EGO_M:
            problem = (
                f"is {away_m:.0f} m from the ego of scene {scene.name}; more than "
                f"{FURTHEST_FROM_EGO_M:.0f} m means another scene or another frame"
            )
            raise InvalidDocument(WHAT, [(place_of(token, index, key, number), problem)])
        return x_m, y_m

    def add(kind: AgentType, point: Point, heading_rad: float, **more: Any) -> None:
        number = len(scene.everyone) + 1 + len(added)
        lane_id = ground.graph.under(*point, heading_rad)
        added.append(_agent(number, kind, (*point, heading_rad), lane_id, **more))

    for kind, key in ((AgentType.VEHICLE, "stopped_vehicle"), (AgentType.BUS, "stopped_bus")):
        for number, (x_m, y_m, yaw_rad) in enumerate(getattr(entry, key)):
            heading_rad = wrap(wrap(yaw_rad) - scene.origin.pose.heading_rad)
            add(kind, place(x_m, y_m, key, number), heading_rad)
    for number, cone in enumerate(entry.cones):
        point = place(*cone, "cones", number)
        # A cone has no direction in the file.
        way_rad = 0.0 if ground.route is None else ground.route.locate(*point).tangent_rad
        add(AgentType.TRAFFIC_CONE, point, way_rad)
    for number, (x_m, y_m, to_x_m, to_y_m, iteration) in enumerate(entry.pedestrian):
        start = place(x_m, y_m, "pedestrian", number)
        end = place(to_x_m, to_y_m, "pedestrian", number)
        walk_m = math.dist(start, end)
        way_rad = wrap(math.atan2(end[1] - start[1], end[0] - start[0]))
        walk = {"speed_mps": round(walk_m / WALK_S, 2), "walk_to_m": end}
        add(AgentType.PEDESTRIAN, start, way_rad, **(walk if walk_m > STANDING_WALK_M else {}))
        if walk_m < _STANDS_M:
            left_out.append(f"pedestrian {number} walks 0 m, which gives it no direction")
        if iteration is not None:
            left_out.append(f"pedestrian {number} starts at iteration {iteration}")
    left_out += [f"key {key}" for key in entry.model_extra or {}]
    return Modification(added=tuple(added)), left_out


def _agent(
    number: int,
    kind: AgentType,
    pose: tuple[float, float, float],
    lane_id: str | None,
    **more: Any,
) -> TrafficAgent:
    length_m, width_m = LENGTH_WIDTH_M[kind]
    return TrafficAgent(
        id=f"Agent{number}",
        type=kind,
        x_m=pose[0],
        y_m=pose[1],
        heading_rad=pose[2],
        width_m=width_m,
        length_m=length_m,
        lane_id=lane_id,
        **({"speed_mps": 0.0} | more),
    )


def traffic_of(
    entry: SpecialScenario,
    details: Details,
    scene: Scene,
    *,
    seed: str,
    clear_of: Sequence[TrafficAgent] = (),
) -> tuple[TrafficAgent, ...]:
    """Return the traffic of a special scenario's density; none without one.

    Args:
        entry: Its roadblocks come before those of the token, an empty list too.
        details: Of its base token.
        scene: Cleared of the recorded traffic.
        seed: interPlan takes the base token.
        clear_of: Who is spawned keeps away from these.

    Raises:
        InvalidDocument: An extra agent has no place or speed.
    """
    density, _ = options_of(entry.config)
    roadblocks = entry.roadblock_locations_to_spawn_agents
    if roadblocks is None:
        roadblocks = details.roadblock_locations_to_spawn_agents or []
    extras = []
    for values in (row[:3] for row in details.extra_agents_to_spawn or []):
        if not all(isinstance(one, (int, float)) and math.isfinite(one) for one in values):
            problem = f"{values!r} must be x, y and a speed in metres and metres per second"
            raise InvalidDocument(WHAT, [("extra_agents_to_spawn", problem)])
        x_m, y_m = _to_local(scene, values[0], values[1])
        extras.append(ExtraAgent(x_m=x_m, y_m=y_m, speed_mps=abs(float(values[2]))))
    return spawn_traffic(
        scene,
        density,
        seed=seed,
        roadblocks_m=[_to_local(scene, *place) for place in roadblocks],
        extras=extras,
        clear_of=clear_of,
    )


def goal_place(source: Mapping[str, Any] | None, goal: str, scene: Scene) -> Point | None:
    """Return where a goal of interPlan's file lies in the ego frame, None where it has no place.

    Args:
        source: A scenario's parts of the file, as they are stored; None for one of another kind.
        goal: left, right or straight.
        scene: Whose origin tells the frame.
    """
    places = ((source or {}).get("details") or {}).get("goal") or {}
    if not places.get(goal):
        return None
    x_m, y_m = (float(part) for part in places[goal].split(","))
    return _to_local(scene, x_m, y_m)


def _to_local(scene: Scene, x_m: float, y_m: float) -> Point:
    x_m, y_m = scene.origin.pose.to_local(np.array([[x_m, y_m]]))[0].tolist()
    return x_m, y_m


# The suffix of options

_CONFIG_PARTS: Final = re.compile(r"[dgo][a-z]|a\d|s\d{1,2}")
_DENSITIES = {None: TrafficDensity.NONE} | {
    one[0]: one for one in TrafficDensity if one is not TrafficDensity.NONE
}
_TURNS = {None: None, "l": TurnType.LEFT, "r": TurnType.RIGHT, "s": TurnType.STRAIGHT}


def options_of(config: str | None) -> tuple[TrafficDensity, TurnType | None]:
    """Return density and goal of a suffix such as "dlgl"."""
    parts = {part[0]: part[1:] for part in _CONFIG_PARTS.findall(config or "")}
    return _DENSITIES[parts.get("d")], _TURNS[parts.get("g")]


def config_of(options: SceneOptions, given: str = "") -> str:
    """Return the suffix of a scenario's options; as given where that says the same already."""
    if options_of(given) == (options.density, options.goal):
        return given
    density = "" if options.density is TrafficDensity.NONE else f"d{options.density[0]}"
    goal = "" if options.goal is None else f"g{options.goal[0]}"
    others = [part for part in _CONFIG_PARTS.findall(given) if part[0] not in "dg"]
    return "".join([density, goal, *others])


# Writing


def token_of(scene_name: str) -> str:
    """Return the base token that stands for a scene: 16 hexadecimal digits, always the same."""
    return hashlib.sha256(scene_name.encode()).hexdigest()[:16]


def yaml_text(
    by_token: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]],
    comments: list[str],
    given: Mapping[str, Any] | None = None,
) -> str:
    """Return the whole file; tokens are quoted, since some would be read as numbers.

    Args:
        by_token: Special scenarios by index, and what stands beside them (empty for interPlan's
            fallbacks), by base token.
        comments: Lines at the top.
        given: What stands beside the tokens; None for interPlan's fallbacks.
    """
    usual = {"accel_max": 1.0, "decel_max": 2.0, "scenario_specifics": None}
    beside = {
        "extra_agents_to_spawn": [],
        "roadblock_locations_to_spawn_agents": [],
        "goal": dict.fromkeys(("left", "right", "straight")),
        "spawn_in_intersection": False,
    }
    document = {
        **(given or usual),
        "modification_details_dictionary": {
            _Quoted(token): {
                **(details or beside),
                "special_scenario": {_Quoted(index): entry for index, entry in entries.items()},
            }
            for token, (entries, details) in by_token.items()
        },
    }
    body = yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=99)
    head = "".join(f"# {escape_controls(' '.join(line.split()))}\n" for line in comments)
    return head + body


class _Quoted(str):
    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    """Points on one line, tokens and indices in quotes, no anchors."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def _represent_list(dumper: _Dumper, items: list[Any]) -> yaml.SequenceNode:
    is_row = all(isinstance(item, (float, int, type(None))) for item in items)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=is_row)


_Dumper.add_representer(
    _Quoted,
    lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style='"'),
)
_Dumper.add_representer(list, _represent_list)
