"""The published Scenario message (scenario.proto and map.proto) as typed values.

World frame: global metres, x and y; what lies in z is left. T steps, P points.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.road_map import FURTHEST_M
from augment.formats.waymo.tfrecord import WHAT
from augment.formats.waymo.wire import (
    block_of,
    read_fields,
    real_of,
    reals_of,
    whole_of,
    wholes_of,
)

FloatArray = NDArray[np.float64]

_STATE = {2: 0, 3: 1, 8: 2, 9: 3, 10: 4, 5: 5, 6: 6, 11: 7}
"""Field numbers of an ObjectState: x, y, heading, velocity x and y, length, width, valid."""
_VALID = 11


@dataclass(slots=True, eq=False)
class TrackMessage:
    """A Track.

    Attributes:
        states: (T, 8): x, y, heading, velocity x, velocity y, length, width, whether valid.
    """

    id: int = 0
    type: int = 0
    states: FloatArray = field(default_factory=lambda: np.zeros((0, 8)))


@dataclass(slots=True)
class BoundaryMessage:
    """A BoundarySegment: along which points of the lane a feature is its boundary."""

    start: int = 0
    end: int = 0
    feature: int = 0


@dataclass(slots=True, eq=False)
class LaneMessage:
    """A LaneCenter."""

    id: int
    line: FloatArray
    speed_limit_mph: float | None = None
    type: int = 0
    interpolating: bool = False
    entries: list[int] = field(default_factory=list)
    exits: list[int] = field(default_factory=list)
    left_neighbors: list[int] = field(default_factory=list)
    right_neighbors: list[int] = field(default_factory=list)
    left_boundaries: list[BoundaryMessage] = field(default_factory=list)
    right_boundaries: list[BoundaryMessage] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class ScenarioMessage:
    """A Scenario.

    Attributes:
        lights: For each step, the state by lane.
        edges: Road lines and road edges, by id.
        polygons: Crosswalks (8), speed bumps (9) and driveways (10) by these numbers.
    """

    id: str = ""
    times_s: list[float] = field(default_factory=list)
    current: int = 0
    ego: int = 0
    tracks: list[TrackMessage] = field(default_factory=list)
    lights: list[dict[int, int]] = field(default_factory=list)
    lanes: dict[int, LaneMessage] = field(default_factory=dict)
    edges: dict[int, FloatArray] = field(default_factory=dict)
    polygons: list[tuple[int, FloatArray]] = field(default_factory=list)
    stop_signs: int = 0


def read_scenario(payload: bytes) -> ScenarioMessage:
    """The message of a record.

    Raises:
        InvalidDocument: It is no Scenario.
    """
    made = ScenarioMessage()
    for number, value in read_fields(payload):
        if number == 1:
            made.times_s += reals_of(value)
        elif number == 2:
            made.tracks.append(_track(block_of(value)))
        elif number == 5:
            made.id = _text(block_of(value))
        elif number == 6:
            made.ego = whole_of(value)
        elif number == 7:
            made.lights.append(_lights(block_of(value)))
        elif number == 8:
            _add_feature(made, block_of(value))
        elif number == 10:
            made.current = whole_of(value)
    return made


def read_times(payload: bytes) -> tuple[list[float], int]:
    """Times and current step alone: what a list of moments needs."""
    times: list[float] = []
    current = 0
    for number, value in read_fields(payload):
        if number == 1:
            times += reals_of(value)
        elif number == 10:
            current = whole_of(value)
    return times, current


# Private


def _text(block: bytes) -> str:
    try:
        return block.decode("ascii")
    except UnicodeDecodeError:
        raise InvalidDocument(WHAT, [("scenario_id", "is no plain text")]) from None


def _track(block: bytes) -> TrackMessage:
    made, rows = TrackMessage(), []
    for number, value in read_fields(block):
        if number == 1:
            made.id = whole_of(value)
        elif number == 2:
            made.type = whole_of(value)
        elif number == 3:
            row = [0.0] * 8
            for inner, one in read_fields(block_of(value)):
                place = _STATE.get(inner)
                if place is not None:
                    row[place] = whole_of(one) if inner == _VALID else real_of(one)
            rows.append(row)
    made.states = np.array(rows, dtype=np.float64).reshape(-1, 8)
    return made


def _lights(block: bytes) -> dict[int, int]:
    lights = {}
    for number, value in read_fields(block):
        if number == 1:
            fields = {inner: one for inner, one in read_fields(block_of(value)) if inner in (1, 2)}
            lights[whole_of(fields.get(1, 0))] = whole_of(fields.get(2, 0))
    return lights


def _add_feature(made: ScenarioMessage, block: bytes) -> None:
    feature_id, kind, inner = 0, 0, b""
    for number, value in read_fields(block):
        if number == 1:
            feature_id = whole_of(value)
        else:
            kind, inner = number, block_of(value)
    if kind == 3:
        made.lanes[feature_id] = _lane(feature_id, inner)
    elif kind in (4, 5):
        made.edges[feature_id] = _points(value for number, value in _blocks(inner) if number == 2)
    elif kind == 7:
        made.stop_signs += 1
    elif kind in (8, 9, 10):
        points = _points(value for number, value in _blocks(inner) if number == 1)
        made.polygons.append((kind, points))


def _blocks(block: bytes) -> Iterator[tuple[int, bytes]]:
    for number, value in read_fields(block):
        if isinstance(value, bytes):
            yield number, value


def _points(blocks: Iterable[bytes]) -> FloatArray:
    rows = []
    for block in blocks:
        row = [0.0, 0.0]
        for number, value in read_fields(block):
            if number in (1, 2):
                row[number - 1] = real_of(value)
        rows.append(row)
    points = np.array(rows, dtype=np.float64).reshape(-1, 2)
    if not (np.abs(points) <= FURTHEST_M).all():
        text = f"has a point that is not finite or beyond {FURTHEST_M:.0e} m"
        raise InvalidDocument(WHAT, [("map_features", text)])
    return points


def _lane(lane_id: int, block: bytes) -> LaneMessage:
    points: list[bytes] = []
    made = LaneMessage(id=lane_id, line=np.zeros((0, 2)))
    lists = {9: made.entries, 10: made.exits}
    neighbors = {11: made.left_neighbors, 12: made.right_neighbors}
    boundaries = {13: made.left_boundaries, 14: made.right_boundaries}
    for number, value in read_fields(block):
        if number == 8:
            points.append(block_of(value))
        elif number == 1:
            made.speed_limit_mph = real_of(value)
        elif number == 2:
            made.type = whole_of(value)
        elif number == 3:
            made.interpolating = bool(whole_of(value))
        elif number in lists:
            lists[number] += wholes_of(value)
        elif number in neighbors:
            fields = dict(read_fields(block_of(value)))
            neighbors[number].append(whole_of(fields.get(1, 0)))
        elif number in boundaries:
            boundaries[number].append(_boundary(block_of(value)))
    made.line = _points(points)
    return made


def _boundary(block: bytes) -> BoundaryMessage:
    fields = dict(read_fields(block))
    start, end, feature = (whole_of(fields.get(number, 0)) for number in (1, 2, 3))
    return BoundaryMessage(start, end, feature)
