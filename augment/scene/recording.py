"""What was recorded after t0: the tracks of the others and the ego's own motion.

Frame: the ego frame of t0 (the Scene's frame). T steps.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, GetCoreSchemaHandler, TypeAdapter
from pydantic_core import CoreSchema, core_schema

from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.schema import CLOSED, Codec, Id, Real, Size, Text, Whole

MOST_TRACKS = 50_000

_Number = Annotated[Real, Field(ge=-1e6, le=1e6)]
_State = tuple[_Number, _Number, _Number, _Number]
_UNSEEN = (np.nan,) * 4


class _NumberList:
    """How an array stands in a document: as a list; a state of NaN alone is null."""

    def __init__(self, item: Any, least: int = 0) -> None:
        self._items = Annotated[list[item], Field(fail_fast=True, min_length=least)]

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(
            _array,
            handler.generate_schema(self._items),
            serialization=core_schema.plain_serializer_function_ser_schema(_rows),
        )


def _array(rows: list[Any]) -> NDArray[np.float64]:
    array = np.array([_UNSEEN if row is None else row for row in rows], dtype=np.float64)
    array.flags.writeable = False
    return array


def _rows(array: NDArray[np.float64]) -> list[Any]:
    return [None if np.isnan(row).all() else row.tolist() for row in array]


_Times = Annotated[NDArray[np.float64], _NumberList(_Number, least=1)]
_Columns = tuple[Literal["x_m"], Literal["y_m"], Literal["heading_rad"], Literal["speed_mps"]]
_States = Annotated[NDArray[np.float64], _NumberList(_State | None)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """One agent over time; row t is NaN where it was not seen.

    Attributes:
        agent_id: The agent's id in the Scene, or a fresh one for who appears after t0.
        states: (T, 4): x_m, y_m, heading_rad, speed_mps of the box centre.
    """

    agent_id: Id
    type: AgentType
    length_m: Size
    width_m: Size
    states: _States


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """The log from t0 on.

    Attributes:
        columns: What the four numbers of a state are.
        times_s: (T,) seconds since t0, the first is 0.
        ego: (T, 4): x_m, y_m, heading_rad, speed_mps of the ego's geometric centre; NaN where
            nobody recorded it, but never at t0.
        tracks: One entry an agent.
    """

    __pydantic_config__ = CLOSED

    columns: _Columns = ("x_m", "y_m", "heading_rad", "speed_mps")
    times_s: _Times
    ego: _States
    tracks: Annotated[tuple[Track, ...], Field(fail_fast=True, max_length=MOST_TRACKS)] = ()

    @property
    def ego_is_seen(self) -> NDArray[np.bool_]:
        """At which moments the ego was recorded, (T,)."""
        return np.asarray(~np.isnan(self.ego).any(axis=1))

    @property
    def shows_ego(self) -> bool:
        """Whether more of the ego was recorded than where it began."""
        return int(self.ego_is_seen.sum()) > 1


def agent_of(track: Track, state: NDArray[np.float64]) -> TrafficAgent:
    """Return the agent of a track as it is in one of its states (4,)."""
    x_m, y_m, heading_rad, speed_mps = (float(value) for value in state)
    return TrafficAgent(
        id=track.agent_id,
        type=track.type,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        width_m=track.width_m,
        length_m=track.length_m,
        speed_mps=speed_mps,
    )


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


_NOTES = Codec("scene notes", TypeAdapter(tuple[Note, ...]))
notes_to_document, notes_from_document = _NOTES.dump, _NOTES.from_parts
