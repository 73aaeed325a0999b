"""interPlan's modification file: its typed shape, its special scenarios as changes, its text.

Frames: the file is in the global frame, which is the one that a scene's origin is given in;
changes are in their scene's ego frame. Metres and radians; positions are centres of boxes. Keys
that nobody knows are kept aside, so that a reader can say that they say nothing here.
"""

import hashlib
import math
import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, repeat
from typing import Annotated, Any, Final, TypeVar

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.checks.ground import Ground
from augment.errors import InvalidDocument
from augment.escaping import escape_controls
from augment.geometry.frames import Pose, wrap
from augment.scene import entities
from augment.scene.density import SpawnedTraffic, fit_boxes, spawn_traffic
from augment.scene.entities import AgentType, Scene, TrafficAgent, TrafficDensity, TurnType
from augment.scene.planned_mover import WALK_S
from augment.scene.schema import Size, Speed, list_problems, path

WHAT = "interPlan file"
TOKENS = "modification_details_dictionary"
OBJECTS = ("stopped_vehicle", "stopped_bus", "cones", "pedestrian")
"""The keys of a special scenario whose rows a change writes anew."""
STANDING_WALK_M: Final = 1.5
"""A walk up to here is a worker's: interPlan's construction workers step 1.0 m."""
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

    type: Annotated[entities.ScenarioType, Strict(False)]
    config: _Config | None = None
    stopped_vehicle: _Objects[_Standing] = []
    stopped_bus: _Objects[_Standing] = []
    cones: _Objects[_Place] = []
    pedestrian: _Objects[_Walk] = []
    roadblock_locations_to_spawn_agents: _Objects[_Place] | None = None


class Details(_Part):
    """Entry under one base token.

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


class Built(_Part):
    """Additions of interPlan's code to a special scenario beyond its file.

    Attributes:
        boxes_m: As `InterplanRules`.
        ego_mps: The ego's speed among spawned traffic, None for the recorded one.
    """

    boxes_m: tuple[tuple[Size, Size], ...] | None = None
    ego_mps: Speed | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class InterplanSource:
    """Source of a scenario in nuPlan and in interPlan's file, whose parts stay verbatim.

    Attributes:
        token: The base token: nuPlan's lidar_pc of t0.
        index: Of the special scenario; None for one that is in no file of interPlan's.
        entry: The special scenario.
        details: What stands beside the special scenarios under the token.
        file: What stands beside the tokens.
        built: Of `Built`; empty for what was imported before there was one.
    """

    token: str
    index: str | None = None
    entry: Mapping[str, Any] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)
    file: Mapping[str, Any] = field(default_factory=dict)
    built: Mapping[str, Any] = field(default_factory=dict)


# Reading


def parse_file(document: object) -> tuple[File, list[tuple[str, str]]]:
    """Return the document in its typed shape, and the faults of the parts that it then lacks.

    A fault costs the special scenario that it is in, else its base token.

    Raises:
        InvalidDocument: It is not interPlan's, with the path and the reason of every fault, or
            it holds no special scenario.
    """
    if not isinstance(document, dict):
        kind = type(document).__name__
        problem = f"expected a mapping with interPlan's keys, got {kind}"
        raise InvalidDocument(WHAT, [("", problem)])
    problems = list[tuple[str, str]]()
    try:
        file = File.model_validate(document)
    except ValidationError as fault:
        problems = list_problems(fault)
        try:
            file = File.model_validate(_leave_out(document, fault))
        except ValidationError:
            raise InvalidDocument(WHAT, problems) from None
    every = file.modification_details_dictionary.values()
    if not any(details.special_scenario for details in every):
        raise InvalidDocument(WHAT, problems or [("", "holds no special scenario")])
    return file, problems


def _leave_out(document: dict[Any, Any], fault: ValidationError) -> dict[Any, Any]:
    """Return the document without the special scenarios, or base tokens, that have a fault."""
    by_token = document.get(TOKENS)
    if not isinstance(by_token, dict):
        return document
    kept = dict(by_token)
    for _, token, *steps in (error["loc"] for error in fault.errors() if error["loc"][1:]):
        details = kept.pop(token, None)
        if steps[:1] == ["special_scenario"] and len(steps) > 2 and details is not None:
            rest = {key: row for key, row in details[steps[0]].items() if key != steps[1]}
            kept[token] = details | {steps[0]: rest}
    return document | {TOKENS: kept}


def entry_place(token: str, index: str | int, *steps: str | int) -> str:
    """Return where in a file a part of a special scenario stands."""
    return path(TOKENS, token, "special_scenario", str(index), *steps)


def read_entry(
    token: str, index: str | int, entry: SpecialScenario, scene: Scene
) -> tuple[entities.Modification, list[str]]:
    """Return a special scenario as a change: vehicles, buses, cones, pedestrians.

    Boxes are interPlan's if known, else our usual ones; cones get the direction of the ego's way.

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
    ground, added, left_out = Ground.of(scene), list[TrafficAgent](), list[str]()

    def place(x_m: float, y_m: float, key: str, number: int) -> entities.Point:
        x_m, y_m = _to_local(scene, x_m, y_m)
        away_m = math.hypot(x_m, y_m)
        if away_m > FURTHEST_FROM_EGO_M:
            problem = (
                f"is {away_m:.0f} m from the ego of scene {scene.name}; more than "
                f"{FURTHEST_FROM_EGO_M:.0f} m means another scene or another frame"
            )
            raise InvalidDocument(WHAT, [(entry_place(token, index, key, number), problem)])
        return x_m, y_m

    def add(kind: AgentType, point: entities.Point, heading_rad: float, **more: Any) -> None:
        pose = Pose(x_m=point[0], y_m=point[1], heading_rad=heading_rad)
        values = more | {"lane_id": ground.graph.under(*point, heading_rad)}
        number = len(scene.everyone) + 1 + len(added)
        added.append(TrafficAgent.at(kind, pose, id=f"Agent{number}", **values))

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
    return fit_boxes(scene, entities.Modification(added=tuple(added))), left_out


def surround(
    entry: SpecialScenario,
    details: Details,
    scene: Scene,
    *,
    token: str,
    vehicles_m: Sequence[tuple[float, float]],
) -> tuple[SpawnedTraffic, Built]:
    """Return the traffic that interPlan spawns around the ego, and its other additions.

    Args:
        entry: Its roadblocks come before those of the token, an empty list too.
        details: Of its base token.
        scene: Cleared of the recorded traffic.
        token: The base token, which seeds interPlan's random numbers.
        vehicles_m: Length and width of the vehicles of t0 as the log lists them.

    Raises:
        InvalidDocument: An extra agent has no place or speed.
    """
    density, _ = parse_suffix(entry.config)
    roadblocks = entry.roadblock_locations_to_spawn_agents
    if roadblocks is None:
        roadblocks = details.roadblock_locations_to_spawn_agents or []
    extras = []
    for values in (row[:3] for row in details.extra_agents_to_spawn or []):
        if not all(
            isinstance(number, (int, float)) and math.isfinite(number) for number in values
        ):
            problem = f"{values!r} must be x, y and a speed in metres and metres per second"
            raise InvalidDocument(WHAT, [("extra_agents_to_spawn", problem)])
        extras.append((*_to_local(scene, values[0], values[1]), float(values[2])))
    rng = random.Random(token)
    is_known = all(0.001 <= metres <= 100.0 for size_m in vehicles_m for metres in size_m)
    # Told to remove all vehicles, interPlan does so twice and forgets the boxes of the first time.
    pool = vehicles_m if is_known and "a0" not in (entry.config or "") else ()
    removed = iter(rng.sample(pool, len(pool)))
    spawned = spawn_traffic(
        scene,
        density,
        rng=rng,
        boxes_m=chain(removed, repeat(scene.ego.size_m)),
        roadblocks_m=[_to_local(scene, *place) for place in roadblocks],
        extras=extras,
    )
    boxes_m = tuple(removed) if is_known else None
    return spawned, Built(boxes_m=boxes_m, ego_mps=spawned.ego_mps)


def follow_rules(scene: Scene, source: Mapping[str, Any] | None) -> Scene:
    """Return the scene as interPlan begins it: its rules, the ego at the speed that it gets.

    Args:
        scene: Of the scenario.
        source: As `goal_place`; without `built` the scene stays as it is.
    """
    if source is None or "built" not in source:
        return scene
    built = Built.model_validate(source["built"], strict=False)
    speed_mps = scene.ego.speed_mps if built.ego_mps is None else built.ego_mps
    options = replace(scene.options, interplan=entities.InterplanRules(boxes_m=built.boxes_m))
    return replace(scene, ego=replace(scene.ego, speed_mps=speed_mps), options=options)


def goal_place(source: Mapping[str, Any] | None, goal: str, scene: Scene) -> entities.Point | None:
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


def _to_local(scene: Scene, x_m: float, y_m: float) -> entities.Point:
    x_m, y_m = scene.origin.pose.to_local(np.array([[x_m, y_m]]))[0].tolist()
    return x_m, y_m


# The suffix of options

_CONFIG_PARTS: Final = re.compile(r"[dgo][a-z]|a\d|s\d{1,2}")
_DENSITIES = {None: TrafficDensity.NONE} | {
    density[0]: density for density in TrafficDensity if density is not TrafficDensity.NONE
}
_TURNS = {None: None, "l": TurnType.LEFT, "r": TurnType.RIGHT, "s": TurnType.STRAIGHT}


def parse_suffix(config: str | None) -> tuple[TrafficDensity, TurnType | None]:
    """Return density and goal of a suffix such as "dlgl"."""
    parts = {part[0]: part[1:] for part in _CONFIG_PARTS.findall(config or "")}
    return _DENSITIES[parts.get("d")], _TURNS[parts.get("g")]


def format_suffix(options: entities.SceneOptions, suffix: str = "") -> str:
    """Return the suffix of a scenario's options; as given where that says the same already."""
    if parse_suffix(suffix) == (options.density, options.goal):
        return suffix
    density = "" if options.density is TrafficDensity.NONE else f"d{options.density[0]}"
    goal = "" if options.goal is None else f"g{options.goal[0]}"
    others = [part for part in _CONFIG_PARTS.findall(suffix) if part[0] not in "dg"]
    return "".join([density, goal, *others])


# Writing


def scene_token(scene_name: str) -> str:
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
            _QuotedText(token): {
                **(details or beside),
                "special_scenario": {
                    _QuotedText(index): entry for index, entry in entries.items()
                },
            }
            for token, (entries, details) in by_token.items()
        },
    }
    body = yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=99)
    head = "".join(f"# {escape_controls(' '.join(line.split()))}\n" for line in comments)
    return head + body


class _QuotedText(str):
    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    """Points on one line, tokens and indices in quotes, no anchors."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def _represent_list(dumper: _Dumper, items: list[Any]) -> yaml.SequenceNode:
    is_row = all(isinstance(item, (float, int, type(None))) for item in items)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=is_row)


_Dumper.add_representer(
    _QuotedText,
    lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style='"'),
)
_Dumper.add_representer(list, _represent_list)
