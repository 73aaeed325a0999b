"""What a source of recorded data did not say and what was assumed instead, as values.

They are kept with the scene. Here are their kinds; what they say to people is said by the
services, which know what a drive or a picture makes of what is missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from augment.errors import InvalidDocument
from augment.scene.schema import CLOSED, Real, Text, Whole, problems_of


class SceneNoteKind(StrEnum):
    """A loss or an assumption."""

    NO_SPEED_LIMITS = "no_speed_limits"
    SOME_SPEED_LIMITS = "some_speed_limits"
    SPEED_LIMITS_IGNORED = "speed_limits_ignored"
    NO_LIGHTS = "no_lights"
    NO_WALKWAYS = "no_walkways"
    NO_DRIVABLE_AREAS = "no_drivable_areas"
    NO_CONNECTIVITY = "no_connectivity"
    NO_INTERSECTIONS = "no_intersections"
    NO_BOX_SIZES = "no_box_sizes"
    SOME_BOX_SIZES = "some_box_sizes"
    EGO_SIZE_ASSUMED = "ego_size_assumed"
    EGO_SIZE_SWAPPED = "ego_size_swapped"
    NO_EGO_MOTION = "no_ego_motion"
    SPEEDS_DIFFERENCED = "speeds_differenced"
    LANE_WIDTHS_ASSUMED = "lane_widths_assumed"
    TRAFFIC_SIDE_ASSUMED = "traffic_side_assumed"
    BICYCLE_LANES_LEFT_OUT = "bicycle_lanes_left_out"
    OBJECTS_LEFT_OUT = "objects_left_out"
    CLASSES_MERGED = "classes_merged"
    MAP_PARTS_LEFT_OUT = "map_parts_left_out"
    FAR_PARTS_LEFT_OUT = "far_parts_left_out"
    LIGHTS_REPEATED = "lights_repeated"
    BOUNDARIES_TURNED = "boundaries_turned"
    TURN_TYPES_CORRECTED = "turn_types_corrected"
    LONG_TIME_STEP = "long_time_step"
    ROUTE = "route"
    ROUTE_NOT_IN_MAP = "route_not_in_map"
    MISSION_GOAL = "mission_goal"
    SCENARIO_TAGS = "scenario_tags"
    INTERPLAN_LEFT_OUT = "interplan_left_out"
    NON_COMMERCIAL = "non_commercial"


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """One loss or assumption.

    Attributes:
        number: How many things it concerns, None where it is all of them.
        of: Of how many.
        value: What was taken instead: metres, or metres per second.
        names: What it concerns, where that has names.
    """

    __pydantic_config__ = CLOSED

    kind: SceneNoteKind
    number: Whole | None = None
    of: Whole | None = None
    value: Real | None = None
    names: Annotated[tuple[Text, ...], Field(exclude_if=lambda names: not names)] = ()


_NOTES = TypeAdapter(tuple[Note, ...])


def notes_to_document(notes: tuple[Note, ...]) -> list[dict[str, Any]]:
    """The notes as a JSON document; fields without a value are left out."""
    made: list[dict[str, Any]] = _NOTES.dump_python(notes, mode="json", exclude_none=True)
    return made


def notes_from_document(document: object) -> tuple[Note, ...]:
    """The notes that a JSON document holds.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    try:
        return _NOTES.validate_python(document)
    except ValidationError as fault:
        raise InvalidDocument("scene notes", problems_of(fault)) from None
