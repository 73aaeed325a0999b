"""The map archive of a log as it lies on the disk, in the city frame."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from augment.errors import InvalidDocument
from augment.formats.argoverse2.log import WHAT
from augment.formats.json_file import read_json
from augment.scene.schema import problems_of


class MapPart(BaseModel):
    """A part of the map file; fields that nobody needs here are allowed."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False, frozen=True)


class MapPoint(MapPart):
    """A point of the city frame."""

    x: float
    y: float


Points = Annotated[list[MapPoint], Field(fail_fast=True, min_length=2)]


class MapSegment(MapPart):
    """A lane segment; boundaries run in the direction of travel."""

    id: int
    is_intersection: bool
    lane_type: Literal["VEHICLE", "BUS", "BIKE"]
    left_lane_boundary: Points
    right_lane_boundary: Points
    predecessors: list[int]
    successors: list[int]
    left_neighbor_id: int | None = None
    right_neighbor_id: int | None = None


class MapCrossing(MapPart):
    """A crosswalk, by its two long edges."""

    edge1: Points
    edge2: Points


class MapDrivable(MapPart):
    """A polygon that can be driven on."""

    area_boundary: Annotated[list[MapPoint], Field(fail_fast=True, min_length=3)]


class MapFile(MapPart):
    """The map archive."""

    lane_segments: dict[str, MapSegment]
    drivable_areas: dict[str, MapDrivable] = {}
    pedestrian_crossings: dict[str, MapCrossing] = {}


def read_map(file: Path) -> MapFile:
    """The map in that file.

    Raises:
        InvalidDocument: The file is no such map; with the path and the reason of every fault.
    """
    try:
        return MapFile.model_validate(read_json(file, what=WHAT))
    except ValidationError as fault:
        problems = [(f"{file.name}: {place}", text) for place, text in problems_of(fault)]
        raise InvalidDocument(WHAT, problems) from None
