"""interPlan's modification file: its keys, and what one special scenario holds.

Frames: the file is in the global frame, metres and radians, which here is the frame that a
scene's origin is given in; agents are in their scene's ego frame. Positions are box centres.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.checks.ground import Ground
from augment.errors import InvalidDocument
from augment.escaping import escape_controls
from augment.scene.entities import (
    Modification,
    ScenarioType,
    SceneOptions,
    TrafficDensity,
    TurnType,
)
from augment.scene.schema import path, problems_of

STANDING_WALK_M: Final = 1.5
"""A walk up to here is a worker's: interPlan's construction workers step 1.0 m."""
WALK_S: Final = 15.0
"""How long a walk takes after its activation, whatever its length."""
MOST_ENTRIES: Final = 100
"""The index of a special scenario has at most two digits."""

GOALS: Final = ("left", "right", "straight")
ACCEL_MAX_MPS2: Final = 1.0
DECEL_MAX_MPS2: Final = 2.0


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadEntry:
    """One special scenario as a modification.

    Attributes:
        id: interPlan's own name: base token, "-s" and the index.
        left_out: What of it a modification can't say.
    """

    id: str
    scene: str
    type: ScenarioType
    modification: Modification
    left_out: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """What a file holds.

    Attributes:
        entries: The special scenarios whose scenes are known, in the file's order.
        passed_over: The base tokens without a scene, with the number of their special scenarios.
        left_out: What stands besides special scenarios and says nothing here.
    """

    entries: tuple[ReadEntry, ...]
    passed_over: Mapping[str, int]
    left_out: tuple[str, ...]


def cone_heading(ground: Ground, x_m: float, y_m: float) -> float:
    """The direction of the ego's way beside a place: what a cone gets, having none in the file."""
    if ground.route is None:
        return 0.0
    return ground.route.locate(x_m, y_m).tangent_rad


def token_of(scene_name: str) -> str:
    """The base token that stands for a scene: 16 hexadecimal digits, always the same."""
    return hashlib.sha256(scene_name.encode()).hexdigest()[:16]


def options_of(config: str | None) -> tuple[TrafficDensity, TurnType | None]:
    """Density and goal of a suffix such as "dlgl"."""
    parts = {part[0]: part[1:] for part in _CONFIG_PARTS.findall(config or "")}
    return _DENSITIES[parts.get("d")], _TURNS[parts.get("g")]


def config_of(options: SceneOptions, given: str = "") -> str:
    """The suffix that says a scenario's options; as given where that says the same already."""
    if options_of(given) == (options.density, options.goal):
        return given
    density = "" if options.density is TrafficDensity.NONE else f"d{options.density[0]}"
    goal = "" if options.goal is None else f"g{options.goal[0]}"
    others = [part for part in _CONFIG_PARTS.findall(given) if part[0] not in "dg"]
    return "".join([density, goal, *others])


def details(
    entries: Mapping[str, Mapping[str, Any]], given: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """What interPlan keeps for one base token, with these special scenarios by index."""
    special = {_Quoted(index): entry for index, entry in entries.items()}
    if given:
        return {**given, "special_scenario": special}
    return {
        "extra_agents_to_spawn": [],
        "roadblock_locations_to_spawn_agents": [],
        "goal": dict.fromkeys(GOALS),
        "spawn_in_intersection": False,
        "special_scenario": special,
    }


def yaml_text(
    by_token: Mapping[str, dict[str, Any]],
    comments: list[str],
    given: Mapping[str, Any] | None = None,
) -> str:
    """The whole file; tokens are quoted, since some would be read as numbers.

    Args:
        by_token: What stands under each base token.
        comments: Lines at the top.
        given: What stands beside the tokens; None for interPlan's fallbacks.
    """
    usual = {"accel_max": ACCEL_MAX_MPS2, "decel_max": DECEL_MAX_MPS2, "scenario_specifics": None}
    document = {
        **(given or usual),
        "modification_details_dictionary": {
            _Quoted(token): one for token, one in by_token.items()
        },
    }
    body = yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=99)
    head = "".join(f"# {escape_controls(' '.join(line.split()))}\n" for line in comments)
    return head + body


_CONFIG_PARTS: Final = re.compile(r"[dgo][a-z]|a\d|s\d{1,2}")
_DENSITIES = {
    None: TrafficDensity.NONE,
    "l": TrafficDensity.LOW,
    "m": TrafficDensity.MEDIUM,
    "h": TrafficDensity.HIGH,
}
_TURNS = {None: None, "l": TurnType.LEFT, "r": TurnType.RIGHT, "s": TurnType.STRAIGHT}


class _Quoted(str):
    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    """Points on one line, tokens and indices in quotes, no anchors."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def _quoted(dumper: _Dumper, text: _Quoted) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style='"')


def _list(dumper: _Dumper, items: list[Any]) -> yaml.SequenceNode:
    is_row = all(isinstance(item, (float, int, type(None))) for item in items)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=is_row)


_Dumper.add_representer(_Quoted, _quoted)
_Dumper.add_representer(list, _list)


WHAT = "interPlan file"
MOST_OBJECTS = 1_000
FURTHEST_M = 1e8
WIDEST_RAD = 100.0

OBJECTS = ("stopped_vehicle", "stopped_bus", "cones", "pedestrian")
"""The keys of a special scenario whose rows a change writes anew."""

_Item = TypeVar("_Item")
_Objects = Annotated[list[_Item], Field(max_length=MOST_OBJECTS, fail_fast=True)]
Metres = Annotated[float, Field(ge=-FURTHEST_M, le=FURTHEST_M)]
Radians = Annotated[float, Field(ge=-WIDEST_RAD, le=WIDEST_RAD)]
Standing = tuple[Metres, Metres, Radians]
Place = Annotated[tuple[Metres, Metres], Strict(False)]
CONFIG = r"^(d[lmh]|g[lrs]|o[amc]|a\d|s\d{1,2})*$"
"""Density, goal, observation, amount of agents and special scenario, as one suffix."""
GoalPlace = Annotated[str, Field(pattern=r"^\s*-?\d{1,9}(\.\d+)?\s*,\s*-?\d{1,9}(\.\d+)?\s*$")]
Iteration = Annotated[int, Field(ge=0, le=1_000_000)]
Token = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
Index = Annotated[str, Field(pattern=r"^[0-9]{1,2}$")] | Annotated[int, Field(ge=0, le=99)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, frozen=True)


class SpecialScenario(_Part):
    """One special scenario."""

    type: Annotated[ScenarioType, Strict(False)]
    config: Annotated[str, Field(pattern=CONFIG)] | None = None
    stopped_vehicle: _Objects[Annotated[Standing, Strict(False)]] = []
    stopped_bus: _Objects[Annotated[Standing, Strict(False)]] = []
    cones: _Objects[Annotated[tuple[Metres, Metres], Strict(False)]] = []
    pedestrian: _Objects[
        Annotated[tuple[Metres, Metres, Metres, Metres, Iteration | None], Strict(False)]
    ] = []
    roadblock_locations_to_spawn_agents: _Objects[Place] | None = None


class Details(_Part):
    """What stands under one base token; only its special scenarios hold objects to read.

    Attributes:
        extra_agents_to_spawn: Rows of x, y and speed, and perhaps how the vehicle behaves.
        goal: "x, y" by turn; None where the turn alone is said.
    """

    extra_agents_to_spawn: _Objects[Annotated[list[Any], Field(min_length=3)]] | None = None
    roadblock_locations_to_spawn_agents: _Objects[Place] | None = None
    goal: dict[str, GoalPlace | None] | None = None
    spawn_in_intersection: bool | None = None
    special_scenario: dict[Index, SpecialScenario] | None = None


class File(_Part):
    """The whole file.

    Attributes:
        accel_max, decel_max: In the published file they refer to another one: "${...}".
    """

    accel_max: float | str | None = None
    decel_max: float | str | None = None
    scenario_specifics: Any = None
    modification_details_dictionary: dict[Token, Details]


def file_of(document: object) -> File:
    """The document in its typed shape.

    Raises:
        InvalidDocument: It is not interPlan's, with the path and the reason of every fault.
    """
    if not isinstance(document, dict):
        kind = type(document).__name__
        raise InvalidDocument(
            WHAT, [("", f"expected a mapping with interPlan's keys, got {kind}")]
        )
    try:
        return File.model_validate(document)
    except ValidationError as fault:
        raise InvalidDocument(WHAT, problems_of(fault)) from None


def left_out_of_file(file: File) -> Iterator[str]:
    """What stands at the top of a file and says nothing here."""
    yield from (f"key {key}" for key in file.model_extra or {})
    if file.scenario_specifics is not None:
        yield "scenario_specifics"


def left_out_of_details(details: Details) -> Iterator[str]:
    """What a base token says that changes nothing here; an export says it again."""
    if details.spawn_in_intersection:
        yield "spawn_in_intersection"
    yield from (f"key {key}" for key in details.model_extra or {})


def place_of(token: str, index: str | int, *steps: str | int) -> str:
    """Where in a file a part of a special scenario stands."""
    return path("modification_details_dictionary", token, "special_scenario", str(index), *steps)
