"""The shape of interPlan's modification file as it is read: its keys, strictly typed.

Keys that nobody knows are kept aside, so that a reader can say that they say nothing here.
Frame: the file's global frame, metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.errors import InvalidDocument
from augment.scene.catalogue import ScenarioType
from augment.scene.schema import path, problems_of

WHAT = "interPlan file"
MOST_OBJECTS = 1_000
FURTHEST_M = 1e8
WIDEST_RAD = 100.0

_Item = TypeVar("_Item")
_Objects = Annotated[list[_Item], Field(max_length=MOST_OBJECTS, fail_fast=True)]
Metres = Annotated[float, Field(ge=-FURTHEST_M, le=FURTHEST_M)]
Radians = Annotated[float, Field(ge=-WIDEST_RAD, le=WIDEST_RAD)]
Standing = tuple[Metres, Metres, Radians]
Iteration = Annotated[int, Field(ge=0, le=1_000_000)]
Token = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
Index = Annotated[str, Field(pattern=r"^[0-9]{1,2}$")] | Annotated[int, Field(ge=0, le=99)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, frozen=True)


class SpecialScenario(_Part):
    """One special scenario."""

    type: Annotated[ScenarioType, Strict(False)]
    config: str | None = None
    stopped_vehicle: _Objects[Annotated[Standing, Strict(False)]] = []
    stopped_bus: _Objects[Annotated[Standing, Strict(False)]] = []
    cones: _Objects[Annotated[tuple[Metres, Metres], Strict(False)]] = []
    pedestrian: _Objects[
        Annotated[tuple[Metres, Metres, Metres, Metres, Iteration | None], Strict(False)]
    ] = []


class Details(_Part):
    """What stands under one base token; only its special scenarios hold objects to read."""

    extra_agents_to_spawn: list[Any] | None = None
    roadblock_locations_to_spawn_agents: list[Any] | None = None
    goal: dict[str, Any] | None = None
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
    """What a base token has besides special scenarios: other traffic, a route."""
    if details.extra_agents_to_spawn:
        yield f"extra_agents_to_spawn ({len(details.extra_agents_to_spawn)})"
    if details.roadblock_locations_to_spawn_agents:
        number = len(details.roadblock_locations_to_spawn_agents)
        yield f"roadblock_locations_to_spawn_agents ({number})"
    goals = [f"{turn} {goal}" for turn, goal in (details.goal or {}).items() if goal is not None]
    if goals:
        yield f"goal ({'; '.join(goals)})"
    if details.spawn_in_intersection:
        yield "spawn_in_intersection"
    yield from (f"key {key}" for key in details.model_extra or {})


def place_of(token: str, index: str | int, *steps: str | int) -> str:
    """Where in a file a part of a special scenario stands."""
    return path("modification_details_dictionary", token, "special_scenario", str(index), *steps)
