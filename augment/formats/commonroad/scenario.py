"""The reader of CommonRoad scenarios, 2018b and 2020a.

The ego is a planning problem, which has a start and no motion, or a recorded vehicle: `item` is
the id of either. `frame` is a time step, for a planning problem the one it starts at.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from augment.formats.commonroad.network import (
    WHAT,
    fault,
    network_of,
    point_of,
    points_of,
    real,
    value_of,
    whole,
)
from augment.formats.documents import Element, read_xml
from augment.formats.reading import (
    LONGEST_GAP_S,
    Log,
    LoggedTrack,
    Moment,
    Reading,
    frame_in,
    frames_every,
    reading_at,
)
from augment.formats.road_map import FloatArray, left_out_notes
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, LENGTH_WIDTH_M, AgentType
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


VERSIONS = ("2018b", "2020a")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Ego:
    item: int
    first: int
    states: FloatArray
    length_m: float
    width_m: float
    is_recorded: bool


class CommonRoad:
    """The reader of CommonRoad XML."""

    name = "commonroad"
    title = "CommonRoad scenario, 2018b or 2020a (XML file)"

    def recognises(self, path: Path) -> bool:
        """An XML file that begins as the format does."""
        if path.suffix.lower() != ".xml" or not path.is_file():
            return False
        with path.open("rb") as file:
            return b"<commonRoad" in file.read(4_000)

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Each planning problem at its start, and where there is none each vehicle over time."""
        root = _root(path)
        problems = list(root.all("planningProblem"))
        for problem in problems:
            number = whole(problem.attributes.get("id"), "planningProblem")
            ego = _ego(root, obstacles_of(root), str(number))
            yield Moment(item=str(number), frame=ego.first)
        if problems:
            return
        step_s = _step_s(root)
        for one in obstacles_of(root).all:
            if one.type is AgentType.VEHICLE and not one.stands:
                times_s = [state.step * step_s for state in one.states]
                for index in frames_every(times_s, every_s):
                    step, time_s = one.states[index].step, times_s[index] - times_s[0]
                    yield Moment(item=str(one.id), frame=step, time_s=time_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene of one ego at one time step."""
        root = _root(path)
        obstacles = obstacles_of(root)
        ego = _ego(root, obstacles, item)
        frame = frame_in(WHAT, ego.first if frame is None else frame, len(ego.states))
        log = Log(
            what=WHAT,
            times_s=np.arange(len(ego.states), dtype=np.float64) * _step_s(root),
            ego=ego.states,
            ego_length_m=ego.length_m,
            ego_width_m=ego.width_m,
            tracks=obstacles.tracks(without=ego.item),
        )
        benchmark = root.attributes.get("benchmarkID", path.stem)[:80]
        source = root.attributes.get("source", "").strip()[:200] or "no source named"
        return reading_at(
            log,
            frame,
            network_of(root, frame),
            name=name,
            world=f"CommonRoad scenario frame of {benchmark}",
            provenance=(
                f"CommonRoad scenario {benchmark}, ego {ego.item}, time step {frame}; {source}"
            ),
            licence=None,
            notes=(*obstacles.notes, *_notes(ego, _step_s(root))),
            item=str(ego.item),
        )


# Private


def _root(path: Path) -> Element:
    root = read_xml(path, what=WHAT)
    if root.name != "commonRoad":
        raise fault(path.name, f"begins with {root.name[:40]!r}, not with 'commonRoad'")
    version = root.attributes.get("commonRoadVersion", "")
    if version not in VERSIONS:
        text = f"version {version[:20]!r} is not known; known: {', '.join(VERSIONS)}"
        raise fault("commonRoadVersion", text)
    return root


def _step_s(root: Element) -> float:
    step_s = real(root.attributes.get("timeStepSize", ""), "timeStepSize")
    if not 0.001 <= step_s <= 10.0:
        raise fault("timeStepSize", f"{step_s:g} s is no step from 0.001 to 10 s")
    return step_s


def _ego(root: Element, obstacles: Obstacles, item: str | None) -> _Ego:
    """The planning problem or vehicle of that id; the first planning problem when None."""
    problems = {
        whole(one.attributes.get("id"), "planningProblem"): one
        for one in root.all("planningProblem")
    }
    vehicles = {one.id: one for one in obstacles.all if not one.stands}
    if item is None and not problems:
        text = "there is no planning problem; name a vehicle as the ego by its id"
        raise fault("planningProblem", f"{text}: {_listed(vehicles)}")
    number = next(iter(problems)) if item is None else whole(item, "item")
    if number in problems:
        initial = problems[number].first("initialState")
        if initial is None:
            raise fault(f"planningProblem {number}", "needs an initialState")
        start = state_of(initial, f"planningProblem {number}")
        states = np.full((max(obstacles.steps, start.step + 1), 4), np.nan)
        states[start.step] = (start.x_m, start.y_m, start.heading_rad, start.speed_mps)
        if len(states) != obstacles.steps:
            raise fault(f"planningProblem {number}", "starts after the last recorded step")
        return _Ego(
            item=number,
            first=start.step,
            states=states,
            length_m=EGO_LENGTH_M,
            width_m=EGO_WIDTH_M,
            is_recorded=False,
        )
    if number not in vehicles:
        known = f"planning problems {_listed(problems)}; vehicles {_listed(vehicles)}"
        raise fault("item", f"{number} is not there; there are {known}")
    vehicle = vehicles[number]
    return _Ego(
        item=number,
        first=vehicle.states[0].step,
        states=rows_of(vehicle, obstacles.steps),
        length_m=vehicle.length_m,
        width_m=vehicle.width_m,
        is_recorded=True,
    )


def _listed(names: Mapping[int, object]) -> str:
    shown = ", ".join(str(name) for name in list(names)[:12]) or "none"
    return shown + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _notes(ego: _Ego, step_s: float) -> Iterator[Note]:
    if not ego.is_recorded:
        yield Note(kind=SceneNoteKind.EGO_SIZE_ASSUMED, value=EGO_LENGTH_M)
        yield Note(kind=SceneNoteKind.NO_EGO_MOTION)
    if step_s > LONGEST_GAP_S:
        yield Note(kind=SceneNoteKind.LONG_TIME_STEP, value=step_s)
    yield Note(kind=SceneNoteKind.NO_DRIVABLE_AREAS)
