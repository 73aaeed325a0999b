"""Obstacles and planning problems as tracks over the time steps of the file."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from augment.formats.commonroad.network import fault, point_of, points_of, real, value_of, whole
from augment.formats.documents import Element
from augment.formats.reading import LoggedTrack
from augment.formats.road_map import left_out_notes
from augment.scene.entities import LENGTH_WIDTH_M, AgentType
from augment.scene.recording import Note, SceneNoteKind

MOST_STEPS = 100_000
TYPE_OF = {
    "car": AgentType.VEHICLE,
    "truck": AgentType.VEHICLE,
    "bus": AgentType.BUS,
    "taxi": AgentType.VEHICLE,
    "priorityVehicle": AgentType.VEHICLE,
    "parkedVehicle": AgentType.VEHICLE,
    "train": AgentType.VEHICLE,
    "bicycle": AgentType.BICYCLE,
    "motorcycle": AgentType.BICYCLE,
    "pedestrian": AgentType.PEDESTRIAN,
    "constructionZone": AgentType.BARRIER,
    "pillar": AgentType.GENERIC_OBJECT,
    "unknown": AgentType.GENERIC_OBJECT,
}
SCENERY = frozenset({"building", "roadBoundary", "medianStrip", "median_strip", "vegetation"})
"""What stands beside the road and is no road user."""


@dataclass(frozen=True, slots=True)
class State:
    """Where something is at a time step."""

    step: int
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """One obstacle.

    Attributes:
        states: By time; of what stands, one.
    """

    id: int
    type: AgentType
    length_m: float
    width_m: float
    states: tuple[State, ...]
    stands: bool
    has_size: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacles:
    """All of a file, with the steps that it lasts."""

    all: tuple[Obstacle, ...]
    steps: int
    notes: tuple[Note, ...]

    def tracks(self, without: int | None) -> tuple[LoggedTrack, ...]:
        """Each as a track, but for the one that is the ego."""
        return tuple(
            LoggedTrack(
                name=f"{one.id:018d}",
                type=one.type,
                length_m=one.length_m,
                width_m=one.width_m,
                states=rows_of(one, self.steps),
            )
            for one in self.all
            if one.id != without
        )


def obstacles_of(root: Element) -> Obstacles:
    """What stands and drives.

    Raises:
        InvalidDocument: A type is unknown or a state breaks the format.
    """
    found, left_out = [], Counter[str]()
    for element in root.all("dynamicObstacle", "staticObstacle", "obstacle"):
        place = f"obstacle {element.attributes.get('id', '')[:20]}"
        kind = element.first("type")
        name = "" if kind is None else kind.text.strip()
        if name in SCENERY:
            left_out[name] += 1
        elif name not in TYPE_OF:
            known = ", ".join([*TYPE_OF, *sorted(SCENERY)])
            raise fault(place, f"unknown type {name[:20]!r}; known: {known}")
        else:
            found.append(_obstacle(element, TYPE_OF[name], place))
    left_out.update(one.name for one in root.all("environmentObstacle", "phantomObstacle"))
    steps = 1 + max((one.states[-1].step for one in found), default=0)
    notes = [*left_out_notes(SceneNoteKind.OBJECTS_LEFT_OUT, left_out)]
    sizeless = sum(not one.has_size for one in found)
    if sizeless:
        notes.append(Note(kind=SceneNoteKind.SOME_BOX_SIZES, number=sizeless, of=len(found)))
    return Obstacles(all=tuple(found), steps=steps, notes=tuple(notes))


def rows_of(one: Obstacle, steps: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """The states of an obstacle (T, 4); what stands is there all the time."""
    made = np.full((steps, 4), np.nan)
    for state in one.states:
        if 0 <= state.step < steps:
            made[state.step] = (state.x_m, state.y_m, state.heading_rad, state.speed_mps)
    if one.stands:
        state = one.states[0]
        made[:] = (state.x_m, state.y_m, state.heading_rad, 0.0)
    return made


def state_of(element: Element, place: str) -> State:
    """A state.

    Raises:
        InvalidDocument: It has no place, or a value is no number.
    """
    position = element.first("position")
    if position is None:
        raise fault(place, "a state needs a position")
    x_m, y_m = _center(position, place)
    heading_rad = value_of(element, "orientation", place)
    step = value_of(element, "time", place)
    if step is not None and not 0.0 <= step <= MOST_STEPS:
        raise fault(place, f"a time step lies from 0 to {MOST_STEPS}, not at {step:g}")
    return State(
        step=0 if step is None else round(step),
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad or 0.0,
        speed_mps=abs(value_of(element, "velocity", place) or 0.0),
    )


# Private


def _obstacle(element: Element, kind: AgentType, place: str) -> Obstacle:
    initial = element.first("initialState")
    if initial is None:
        raise fault(place, "needs an initialState")
    states = [state_of(initial, place)]
    trajectory = element.first("trajectory")
    if trajectory is not None:
        states += [state_of(one, place) for one in trajectory.all("state")]
    role = element.first("role")
    size = _size(element, place)
    length_m, width_m = size or LENGTH_WIDTH_M[kind]
    return Obstacle(
        id=whole(element.attributes.get("id"), place),
        type=kind,
        length_m=length_m,
        width_m=width_m,
        states=tuple(sorted(states, key=lambda state: state.step)),
        stands=element.name == "staticObstacle"
        or (role is not None and role.text.strip() == "static"),
        has_size=size is not None,
    )


def _size(element: Element, place: str) -> tuple[float, float] | None:
    """Length and width of the shape; of several shapes, the first."""
    shape = element.first("shape")
    if shape is None:
        return None
    for child in shape.children:
        if child.name == "rectangle":
            length, width = child.first("length"), child.first("width")
            if length is None or width is None:
                raise fault(place, "a rectangle needs a length and a width")
            return real(length.text, place), real(width.text, place)
        if child.name == "circle" and (radius := child.first("radius")) is not None:
            return 2.0 * real(radius.text, place), 2.0 * real(radius.text, place)
        if child.name == "polygon":
            points = points_of(child, place)
            if len(points) >= 3:
                length_m, width_m = np.ptp(points, axis=0).tolist()
                return length_m, width_m
    return None


def _center(position: Element, place: str) -> tuple[float, float]:
    point = position.first("point")
    if point is not None:
        return point_of(point, place)
    for shape in position.all("rectangle", "circle"):
        center = shape.first("center")
        if center is not None:
            return point_of(center, place)
    polygon = position.first("polygon")
    if polygon is not None and len(points := points_of(polygon, place)):
        x_m, y_m = points.mean(axis=0).tolist()
        return x_m, y_m
    raise fault(place, "a position needs a point, or a shape with a centre")
