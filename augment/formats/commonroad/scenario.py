"""The reader of CommonRoad scenarios, 2018b and 2020a.

`item` is the id of a planning problem or of a vehicle that becomes the ego; without one the first
planning problem, else the first vehicle. `frame` is a time step; without one the step where the
ego begins.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from augment.formats.commonroad.network import network_of, points_of, real, whole
from augment.formats.documents import read_xml
from augment.formats.reading import LONGEST_GAP_S, Log, LoggedTrack, LogReader
from augment.formats.road_map import left_out_notes
from augment.formats.values import WHAT, fault_at, look_up
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType

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
SCENERY = frozenset(
    {
        *("building", "roadBoundary", "medianStrip", "median_strip", "vegetation"),
        *("environmentObstacle", "phantomObstacle"),
    }
)
"""What stands beside the road and is no road user."""
ASSUMED = (
    f"The ego is assumed to be {EGO_LENGTH_M:g} m long.",
    "The ego's motion was not recorded: drives are measured by an IDM drive.",
)
State = tuple[float, float, float, float]
"""x, y, heading, speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """An obstacle, or the ego of a planning problem.

    Attributes:
        size_m: Length and width, zeros where the file does not tell them.
        states: By time step; of what stands, one.
    """

    id: int
    type: AgentType
    size_m: tuple[float, float]
    states: dict[int, State]
    stands: bool = False

    def track(self, steps: int) -> LoggedTrack:
        """Return its states at each step; what stands is there all the time."""
        states = np.full((steps, 4), np.nan)
        if self.stands:
            states[:] = (*next(iter(self.states.values()))[:3], 0.0)
        else:
            states[list(self.states)] = list(self.states.values())
        length_m, width_m = self.size_m
        name = f"{self.id:018d}"
        return LoggedTrack(
            name=name, type=self.type, length_m=length_m, width_m=width_m, states=states
        )


class CommonRoad(LogReader):
    """The reader of CommonRoad XML."""

    name = "commonroad"
    title = "CommonRoad scenario, 2018b or 2020a (XML file)"
    suffix, marker = ".xml", b"<commonRoad"

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """One for each planning problem, and where there is none for each vehicle."""
        root, step_s = _root(path)
        obstacles, notes = _obstacles(root)
        problems = [_problem(element) for element in root.findall("planningProblem")]
        vehicles = [one for one in obstacles if one.type is AgentType.VEHICLE and not one.stands]
        egos = {str(one.id): one for one in (*problems, *vehicles)}
        chosen = problems or vehicles
        if item is not None:
            chosen = [look_up(egos, item, "item")]
        if step_s > LONGEST_GAP_S:
            notes.append(f"Steps lie {step_s:g} s apart; a drive looks between them.")
        steps = 1 + max((max(one.states) for one in (*obstacles, *chosen)), default=0)
        benchmark = root.get("benchmarkID", path.stem)[:80]
        for ego in chosen:
            yield Log(
                times_s=np.arange(steps, dtype=np.float64) * step_s,
                ego=ego.track(steps).states,
                ego_size_m=ego.size_m,
                tracks=[one.track(steps) for one in obstacles if one is not ego],
                map_at=lambda frame: network_of(root, frame),
                world=f"CommonRoad scenario frame of {benchmark}",
                title=f"CommonRoad scenario {benchmark}, ego {ego.id}",
                licence=root.get("source", "").strip()[:200] or "no source named",
                is_free=True,
                item=str(ego.id),
                frame=min(ego.states),
                notes=[*notes, *(ASSUMED if ego in problems else [])],
            )


# Private


def _root(path: Path) -> tuple[Element, float]:
    """The file and the seconds between its steps."""
    root = read_xml(path, what=WHAT)
    version = root.get("commonRoadVersion", "")
    if root.tag != "commonRoad" or version not in VERSIONS:
        text = f"is {root.tag[:40]!r} of version {version[:20]!r}, not commonRoad of"
        raise fault_at(path.name, f"{text} {' or '.join(VERSIONS)}")
    step_s = real(root.get("timeStepSize"), "timeStepSize")
    if not 0.001 <= step_s <= 10.0:
        raise fault_at("timeStepSize", f"{step_s:g} s is no step from 0.001 to 10 s")
    return root, step_s


def _problem(element: Element) -> Obstacle:
    number = whole(element.get("id"), "planningProblem")
    step, state = _state(element.find("initialState"), f"planningProblem {number}")
    return Obstacle(
        id=number,
        type=AgentType.EGO_VEHICLE,
        size_m=(EGO_LENGTH_M, EGO_WIDTH_M),
        states={step: state},
    )


def _obstacles(root: Element) -> tuple[list[Obstacle], list[str]]:
    """What stands and drives, and what is left out of it."""
    obstacles, left_out = [], Counter[str]()
    for element in root:
        kind = element.findtext("type", "").strip()
        place = f"obstacle {element.get('id', '')[:20]}"
        if not element.tag.lower().endswith("obstacle"):
            continue
        if kind in SCENERY or element.tag in SCENERY:
            left_out[kind or element.tag] += 1
            continue
        elements = [element.find("initialState"), *element.findall("trajectory/state")]
        role = element.findtext("role", "").strip()  # in 2018b
        obstacles.append(
            Obstacle(
                id=whole(element.get("id"), place),
                type=look_up(TYPE_OF, kind, place),
                size_m=_size(element, place),
                states=dict(sorted(_state(one, place) for one in elements)),
                stands=element.tag == "staticObstacle" or role == "static",
            )
        )
    return obstacles, left_out_notes("objects", left_out)


def _state(element: Element | None, place: str) -> tuple[int, State]:
    """The time step, and where something is then; 0 for what is not given."""
    if element is None:
        raise fault_at(place, "needs an initialState")
    names = ("time", "position/point/x", "position/point/y", "orientation", "velocity")
    texts = [element.findtext(f"{name}/exact", element.findtext(name)) for name in names]
    if texts[1] is None:
        raise fault_at(place, "a position needs a point")
    values = [
        real(text or "0", f"{place}.{name}") for text, name in zip(texts, names, strict=True)
    ]
    step, x_m, y_m, heading_rad, speed_mps = values
    if not 0.0 <= step <= MOST_STEPS:
        raise fault_at(place, f"a time step lies from 0 to {MOST_STEPS}, not at {step:g}")
    return round(step), (x_m, y_m, heading_rad, abs(speed_mps))


def _size(element: Element, place: str) -> tuple[float, float]:
    """Length and width of the first shape, zeros where there is none."""
    shape = element.find("shape/*")
    if shape is None:
        return 0.0, 0.0
    if shape.tag == "polygon" and len(points := points_of(shape, place)):
        length_m, width_m = np.ptp(points, axis=0).tolist()
        return length_m, width_m
    if shape.tag == "circle":
        diameter_m = 2.0 * real(shape.findtext("radius"), place)
        return diameter_m, diameter_m
    return real(shape.findtext("length", "0"), place), real(shape.findtext("width", "0"), place)
