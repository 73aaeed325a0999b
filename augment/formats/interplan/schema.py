"""The shape of interPlan's modification file as it is read: its keys, strictly typed.

Keys that nobody knows are kept aside, so that a reader can say that they say nothing here.
Frame: the file's global frame, metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.errors import InvalidDocument
from augment.scene.entities import ScenarioType
from augment.scene.schema import path, problems_of

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
