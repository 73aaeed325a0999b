"""The reader of CommonRoad scenarios, 2018b and 2020a.

`item` is the id of a planning problem or of a vehicle that becomes the ego; the first planning
problem without one. `frame` is a time step; without one the step where the ego begins.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from augment.formats.commonroad.network import (
    WHAT,
    fault,
    network_of,
    point_of,
    points_of,
    real,
    whole,
)
from augment.formats.documents import read_xml
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

VERSIONS = ("2018b", "2020a")
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
State = tuple[float, float, float, float]
"""x, y, heading, speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """An obstacle, or the ego of a planning problem.

    Attributes:
        states: By time step, ascending; of what stands, one.
        has_size: Whether the file tells its size.
    """

    id: int
    type: AgentType
    length_m: float
    width_m: float
    states: dict[int, State]
    stands: bool = False
    has_size: bool = True

    def rows(self, steps: int) -> FloatArray:
        """Return the states of each step (T, 4); what stands is there all the time."""
        made = np.full((steps, 4), np.nan)
        if self.stands:
            made[:] = (*next(iter(self.states.values()))[:3], 0.0)
        else:
            made[list(self.states)] = list(self.states.values())
        return made


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
        root, step_s = _root(path)
        obstacles, _ = _obstacles(root)
        problems = _problems(root)
        for item in problems:
            yield Moment(item=str(item), frame=min(_ego(root, obstacles, str(item)).states))
        for one in [] if problems else obstacles.values():
            if one.type is AgentType.VEHICLE and not one.stands:
                steps = list(one.states)
                times_s = [step * step_s for step in steps]
                for index in frames_every(times_s, every_s):
                    time_s = times_s[index] - times_s[0]
                    yield Moment(item=str(one.id), frame=steps[index], time_s=time_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene of one ego at one time step."""
        root, step_s = _root(path)
        obstacles, notes = _obstacles(root)
        ego = _ego(root, obstacles, item)
        steps = 1 + max((max(one.states) for one in obstacles.values()), default=0)
        first = min(ego.states)
        if first >= steps:
            raise fault(f"planningProblem {ego.id}", "starts after the last recorded step")
        frame = frame_in(WHAT, first if frame is None else frame, steps)
        log = Log(
            what=WHAT,
            times_s=np.arange(steps, dtype=np.float64) * step_s,
            ego=ego.rows(steps),
            ego_length_m=ego.length_m,
            ego_width_m=ego.width_m,
            tracks=tuple(
                LoggedTrack(
                    name=f"{one.id:018d}",
                    type=one.type,
                    length_m=one.length_m,
                    width_m=one.width_m,
                    states=one.rows(steps),
                )
                for one in obstacles.values()
                if one.id != ego.id
            ),
        )
        if not ego.has_size:
            notes.append(Note(kind=SceneNoteKind.EGO_SIZE_ASSUMED, value=EGO_LENGTH_M))
            notes.append(Note(kind=SceneNoteKind.NO_EGO_MOTION))
        if step_s > LONGEST_GAP_S:
            notes.append(Note(kind=SceneNoteKind.LONG_TIME_STEP, value=step_s))
        benchmark = root.get("benchmarkID", path.stem)[:80]
        source = root.get("source", "").strip()[:200] or "no source named"
        return reading_at(
            log,
            frame,
            network_of(root, frame),
            name=name,
            world=f"CommonRoad scenario frame of {benchmark}",
            provenance=(
                f"CommonRoad scenario {benchmark}, ego {ego.id}, time step {frame}; {source}"
            ),
            licence=None,
            notes=(*notes, Note(kind=SceneNoteKind.NO_DRIVABLE_AREAS)),
            item=str(ego.id),
        )


# Private


def _root(path: Path) -> tuple[Element, float]:
    """The file and the seconds between its steps."""
    root = read_xml(path, what=WHAT)
    if root.tag != "commonRoad":
        raise fault(path.name, f"begins with {root.tag[:40]!r}, not with 'commonRoad'")
    version = root.get("commonRoadVersion", "")
    if version not in VERSIONS:
        text = f"version {version[:20]!r} is not known; known: {', '.join(VERSIONS)}"
        raise fault("commonRoadVersion", text)
    step_s = real(root.get("timeStepSize"), "timeStepSize")
    if not 0.001 <= step_s <= 10.0:
        raise fault("timeStepSize", f"{step_s:g} s is no step from 0.001 to 10 s")
    return root, step_s


def _problems(root: Element) -> dict[int, Element]:
    problems = root.findall("planningProblem")
    return {whole(one.get("id"), "planningProblem"): one for one in problems}


def _ego(root: Element, obstacles: Mapping[int, Obstacle], item: str | None) -> Obstacle:
    """The planning problem or vehicle of that id; the first planning problem when None."""
    problems = _problems(root)
    vehicles = {key: one for key, one in obstacles.items() if not one.stands}
    if item is None and not problems:
        text = "there is no planning problem; name a vehicle as the ego by its id"
        raise fault("planningProblem", f"{text}: {_listed(vehicles)}")
    number = next(iter(problems)) if item is None else whole(item, "item")
    if number in problems:
        step, state = _state(problems[number].find("initialState"), f"planningProblem {number}")
        return Obstacle(
            id=number,
            type=AgentType.EGO_VEHICLE,
            length_m=EGO_LENGTH_M,
            width_m=EGO_WIDTH_M,
            states={step: state},
            has_size=False,
        )
    if number not in vehicles:
        known = f"planning problems {_listed(problems)}; vehicles {_listed(vehicles)}"
        raise fault("item", f"{number} is not there; there are {known}")
    return vehicles[number]


def _listed(names: Mapping[int, object]) -> str:
    shown = ", ".join(str(name) for name in list(names)[:12]) or "none"
    return shown + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _obstacles(root: Element) -> tuple[dict[int, Obstacle], list[Note]]:
    """What stands and drives by its id, and what is left out of it."""
    found, left_out = {}, Counter[str]()
    for element in root:
        if element.tag in ("environmentObstacle", "phantomObstacle"):
            left_out[element.tag] += 1
        if element.tag not in ("dynamicObstacle", "staticObstacle", "obstacle"):
            continue
        place = f"obstacle {element.get('id', '')[:20]}"
        kind = element.findtext("type", "").strip()
        if kind in SCENERY:
            left_out[kind] += 1
        elif kind in TYPE_OF:
            made = _obstacle(element, TYPE_OF[kind], place)
            found[made.id] = made
        else:
            known = ", ".join([*TYPE_OF, *sorted(SCENERY)])
            raise fault(place, f"unknown type {kind[:20]!r}; known: {known}")
    notes = [*left_out_notes(SceneNoteKind.OBJECTS_LEFT_OUT, left_out)]
    sizeless = sum(not one.has_size for one in found.values())
    if sizeless:
        notes.append(Note(kind=SceneNoteKind.SOME_BOX_SIZES, number=sizeless, of=len(found)))
    return found, notes


def _obstacle(element: Element, kind: AgentType, place: str) -> Obstacle:
    elements = [element.find("initialState"), *element.findall("trajectory/state")]
    states = sorted(_state(one, place) for one in elements)
    size = _size(element, place)
    length_m, width_m = size or LENGTH_WIDTH_M[kind]
    is_static = element.tag == "staticObstacle" or element.findtext("role", "").strip() == "static"
    return Obstacle(
        id=whole(element.get("id"), place),
        type=kind,
        length_m=length_m,
        width_m=width_m,
        states=dict(states),
        stands=is_static,
        has_size=size is not None,
    )


def _state(element: Element | None, place: str) -> tuple[int, State]:
    """The time step, and where something is then."""
    if element is None:
        raise fault(place, "needs an initialState")
    position = element.find("position")
    if position is None:
        raise fault(place, "a state needs a position")
    heading_rad, step, speed_mps = (
        _value(element, name, place) for name in ("orientation", "time", "velocity")
    )
    if not 0.0 <= step <= MOST_STEPS:
        raise fault(place, f"a time step lies from 0 to {MOST_STEPS}, not at {step:g}")
    return round(step), (*_center(position, place), heading_rad, abs(speed_mps))


def _value(parent: Element, name: str, place: str) -> float:
    """A value given exactly or as an interval, whose middle is taken; 0 where it is not given."""
    element = parent.find(name)
    if element is None:
        return 0.0
    ends = [element.findtext(end) for end in ("intervalStart", "intervalEnd")]
    given = ends if None not in ends else [element.findtext("exact", element.text or "")]
    return sum(real(text, f"{place}.{name}") for text in given) / len(given)


def _center(position: Element, place: str) -> tuple[float, float]:
    """The point, else the centre of the first shape."""
    for where in ("point", "rectangle/center", "circle/center"):
        point = position.find(where)
        if point is not None:
            return point_of(point, place)
    polygon = position.find("polygon")
    if polygon is not None and len(points := points_of(polygon, place)):
        x_m, y_m = points.mean(axis=0).tolist()
        return x_m, y_m
    raise fault(place, "a position needs a point, or a shape with a centre")


def _size(element: Element, place: str) -> tuple[float, float] | None:
    """Length and width of the first shape."""
    for shape in element.findall("shape/*"):
        if shape.tag == "rectangle":
            return real(shape.findtext("length"), place), real(shape.findtext("width"), place)
        if shape.tag == "circle":
            diameter_m = 2.0 * real(shape.findtext("radius"), place)
            return diameter_m, diameter_m
        if shape.tag == "polygon" and len(points := points_of(shape, place)) >= 3:
            length_m, width_m = np.ptp(points, axis=0).tolist()
            return length_m, width_m
    return None
