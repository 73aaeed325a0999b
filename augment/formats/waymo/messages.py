"""The published Scenario message, read by protobuf (scenario.proto has the parts of it).

World frame: global metres, x and y; what lies in z is left. T steps, P points.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError

from augment.errors import InvalidDocument
from augment.formats.road_map import FURTHEST_M, FloatArray
from augment.formats.waymo.scenario import WHAT
from augment.formats.waymo.scenario_pb2 import Scenario


@dataclass(slots=True, kw_only=True)
class MapFeatures:
    """The map of a scenario, by the features' ids.

    Attributes:
        lanes: The messages, and lines: their middles (P, 2).
        edges: Road lines and road edges (P, 2).
        polygons: Crosswalks, speed bumps and driveways (P, 2) by these names.
    """

    lanes: dict[int, Any] = field(default_factory=dict)
    lines: dict[int, FloatArray] = field(default_factory=dict)
    edges: dict[int, FloatArray] = field(default_factory=dict)
    polygons: list[tuple[str, FloatArray]] = field(default_factory=list)
    stop_signs: int = 0


def read_scenario(payload: bytes) -> Any:
    """The message of a record.

    Raises:
        InvalidDocument: It is no Scenario.
    """
    try:
        return Scenario.FromString(payload)
    except DecodeError as fault:
        raise InvalidDocument(WHAT, [("message", f"is broken: {fault}")]) from None


def features_of(scenario: Any) -> MapFeatures:
    """The map.

    Raises:
        InvalidDocument: A point is nowhere on earth.
    """
    features = MapFeatures()
    for feature in scenario.map_features:
        kind = feature.WhichOneof("feature_data")
        if kind == "lane":
            features.lanes[feature.id] = feature.lane
            features.lines[feature.id] = _points(feature.lane.polyline)
        elif kind in ("road_line", "road_edge"):
            features.edges[feature.id] = _points(getattr(feature, kind).points)
        elif kind == "stop_sign":
            features.stop_signs += 1
        elif kind is not None:
            features.polygons.append((kind, _points(getattr(feature, kind).points)))
    return features


def states_of(track: Any) -> FloatArray:
    """States (T, 4): x, y, heading and speed; NaN where the track is not valid."""
    rows = [
        (one.center_x, one.center_y, one.heading, np.hypot(one.velocity_x, one.velocity_y))
        if one.valid
        else (np.nan,) * 4
        for one in track.states
    ]
    states = np.array(rows, dtype=np.float64).reshape(-1, 4)
    states[~np.isfinite(states).all(axis=1)] = np.nan
    return states


# Private


def _points(points: Iterable[Any]) -> FloatArray:
    made = np.array([(point.x, point.y) for point in points], dtype=np.float64).reshape(-1, 2)
    if not (np.abs(made) <= FURTHEST_M).all():
        text = f"has a point that is not finite or beyond {FURTHEST_M:.0e} m"
        raise InvalidDocument(WHAT, [("map_features", text)])
    return made
