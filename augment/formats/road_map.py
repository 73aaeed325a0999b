"""What readers make of a source's map, and what becomes of it: values alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from augment.scene.entities import (
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    TrafficLight,
    TrafficSide,
    TurnType,
)
from augment.scene.recording import Note, SceneNoteKind

FloatArray = NDArray[np.float64]
Name = int | str

FURTHEST_M = 1e8
"""Nothing on earth is further from the origin of a map."""


MOST_NAMED = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment:
    """A piece of lane in the source's world frame, in the direction of travel.

    Attributes:
        name: Its id in the source; all of one map are of one kind.
        centerline: (P, 2); None for the middle between the boundaries.
        left, right: (P, 2), None where the source has no boundaries.
        width_m: None to measure it between the boundaries.
        crosses: Whether it lies in an intersection.
        successors, predecessors: Names; a joint counts if either end names it.
        left_neighbors, right_neighbors: Names of what lies beside it; what is oncoming is passed
            over.
        light: Of the segment itself, or of all that follows it where it lies in no intersection.
        turn: None for what the shape says.
    """

    name: Name
    crosses: bool = False
    centerline: FloatArray | None = None
    left: FloatArray | None = None
    right: FloatArray | None = None
    width_m: float | None = None
    successors: tuple[Name, ...] = ()
    predecessors: tuple[Name, ...] = ()
    left_neighbors: tuple[Name, ...] = ()
    right_neighbors: tuple[Name, ...] = ()
    speed_limit_mps: float | None = None
    light: TrafficLight = TrafficLight.UNKNOWN
    turn: TurnType | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadMap:
    """What a source's map holds, in its world frame.

    Attributes:
        what, place: How faults call the source and the file.
        side: Where the lanes do not tell on which side people drive.
        is_side_told: Whether the source itself says so, whatever the lanes look like.
        notes: What the map does not say.
    """

    what: str
    place: str
    segments: tuple[Segment, ...]
    areas: tuple[tuple[AreaKind, FloatArray], ...] = ()
    side: TrafficSide = TrafficSide.RIGHT
    is_side_told: bool = False
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MapExtract:
    """What a scene takes from the map; ids count from the nearest to the ego.

    Attributes:
        side_is_assumed: Whether no two oncoming lanes told the side.
        far: How many segments and areas lie too far from the ego and were left out.
    """

    traffic_side: TrafficSide
    lanes: tuple[Lane, ...]
    connectors: tuple[LaneConnector, ...]
    areas: tuple[Area, ...]
    side_is_assumed: bool = False
    far: int = 0


def limit_notes(segments: Sequence[Segment]) -> Iterator[Note]:
    """Of how many lanes the map has no speed limit."""
    unlimited = sum(segment.speed_limit_mps is None for segment in segments)
    if segments and unlimited == len(segments):
        yield Note(kind=SceneNoteKind.NO_SPEED_LIMITS)
    elif unlimited:
        kind = SceneNoteKind.SOME_SPEED_LIMITS
        yield Note(kind=kind, number=unlimited, of=len(segments))


def count_notes(counts: dict[SceneNoteKind, int]) -> Iterator[Note]:
    """A note of each kind with its number, where that is not 0."""
    return (Note(kind=kind, number=number) for kind, number in counts.items() if number)


def left_out_notes(kind: SceneNoteKind, counts: dict[str, int]) -> Iterator[Note]:
    """What is left out, by name, where there is any of it."""
    names = tuple(sorted(name for name, number in counts.items() if number))
    if names:
        yield Note(kind=kind, number=sum(counts.values()), names=names[:MOST_NAMED])
