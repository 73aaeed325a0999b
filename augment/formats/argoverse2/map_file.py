"""The map archive of a log: as it lies on the disk, and as what every reader's map is.

City frame. Bicycle lanes are left out: no car drives there. The format has no speed limits, no
lights (their state is unknown) and no sidewalks; boundaries run in the direction of travel.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from augment.errors import InvalidDocument
from augment.formats.documents import read_json
from augment.formats.road_map import RoadMap, Segment, count_notes
from augment.scene.entities import AreaKind
from augment.scene.recording import Note, SceneNoteKind
from augment.scene.schema import problems_of

LICENCE = "CC BY-NC-SA 4.0"


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


def read_map(file: Path, *, what: str) -> RoadMap:
    """The map in that file as segments and areas, with what maps of Argoverse 2 don't say.

    Raises:
        InvalidDocument: The file is no such map; with the path and the reason of every fault.
    """
    document = read_json(file, what=what)
    try:
        city = MapFile.model_validate(document)
    except ValidationError as fault:
        problems = [(f"{file.name}: {place}", text) for place, text in problems_of(fault)]
        raise InvalidDocument(what, problems) from None
    areas = [
        (AreaKind.DRIVABLE, _points(area.area_boundary)) for area in city.drivable_areas.values()
    ]
    for crossing in city.pedestrian_crossings.values():
        one, other = _points(crossing.edge1), _points(crossing.edge2)
        same_way = float(np.dot(one[-1] - one[0], other[-1] - other[0])) > 0.0
        areas.append((AreaKind.CROSSWALK, np.vstack([one, other[::-1] if same_way else other])))
    driven = [one for one in city.lane_segments.values() if one.lane_type != "BIKE"]
    bicycle_lanes = len(city.lane_segments) - len(driven)
    return RoadMap(
        what=what,
        place=f"{file.name}: lane_segments",
        segments=tuple(_segment(segment) for segment in driven),
        areas=tuple(areas),
        notes=(
            Note(kind=SceneNoteKind.NO_SPEED_LIMITS),
            Note(kind=SceneNoteKind.NO_LIGHTS),
            Note(kind=SceneNoteKind.NO_WALKWAYS),
            *count_notes({SceneNoteKind.BICYCLE_LANES_LEFT_OUT: bicycle_lanes}),
        ),
    )


# Private


def _segment(segment: MapSegment) -> Segment:
    left, right = segment.left_neighbor_id, segment.right_neighbor_id
    return Segment(
        name=segment.id,
        crosses=segment.is_intersection,
        left=_points(segment.left_lane_boundary),
        right=_points(segment.right_lane_boundary),
        successors=tuple(segment.successors),
        predecessors=tuple(segment.predecessors),
        left_neighbors=() if left is None else (left,),
        right_neighbors=() if right is None else (right,),
    )


def _points(points: Sequence[MapPoint]) -> NDArray[np.float64]:
    return np.array([[point.x, point.y] for point in points])
