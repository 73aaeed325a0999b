"""The reader of CommonRoad scenarios, 2018b and 2020a.

`item` is the id of a planning problem or of a vehicle that becomes the ego; without one the first
planning problem, else the first vehicle. `frame` is a time step; without one the step where the
ego begins.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.commonroad.network import read_network
from augment.formats.commonroad.states import StateReader, read_box
from augment.formats.documents import read_xml
from augment.formats.reading import Log, LogReader
from augment.formats.road_map import note_left_out
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType
from augment.scene.recording import Track

VERSIONS = ("2018b", "2020a", "2024")
TYPE_OF = foreign.name_all(
    {
        AgentType.VEHICLE: "car truck taxi priorityVehicle parkedVehicle train",
        AgentType.BUS: "bus",
        AgentType.BICYCLE: "bicycle motorcycle",
        AgentType.PEDESTRIAN: "pedestrian",
        AgentType.BARRIER: "constructionZone",
        AgentType.GENERIC_OBJECT: "pillar unknown",
    }
)
_OTHERS = "location scenarioTags lanelet trafficSign trafficLight intersection planningProblem"
SCENERY = (
    "building roadBoundary medianStrip median_strip vegetation environmentObstacle phantomObstacle"
)
"""What stands beside the road and is no road user."""
ASSUMED = (
    f"The ego is assumed to be {EGO_LENGTH_M:g} m long.",
    "The ego's motion was not recorded: drives are measured by an IDM drive.",
    "The goal of the planning problem has no place in a scene and was left out.",
)
PROBLEM = "planning problem"
_VEHICLES = ("car", "truck", "bus", "taxi", "priorityVehicle", "parkedVehicle", "motorcycle")
DRIVERS = (PROBLEM, *_VEHICLES)
"""Whose place the ego can take."""
NO_EGO = (
    "no planning problem and no moving car, truck or taxi is here to be the ego; who could be, as "
    "the item: {}. Or put an ego on a lane: --ego-at LANE,S of import_scene"
)
MOST_OFFERED = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """An obstacle, or the ego of a planning problem.

    Attributes:
        kind: What the file calls it.
        size_m: Length and width, zeros where the file does not tell them.
        states: (K, 4) of its centre at the steps (K,); of what stands, one.
    """

    id: int
    kind: str
    size_m: tuple[float, float]
    steps: list[int]
    states: FloatArray
    stands: bool = False

    @property
    def type(self) -> AgentType:
        """Type of the agent."""
        return TYPE_OF.get(self.kind, AgentType.EGO_VEHICLE)

    def track(self, steps: int) -> Track:
        """Return its states at each step; what stands is there all the time."""
        states = np.full((steps, 4), np.nan)
        states[slice(None) if self.stands else self.steps] = self.states
        length_m, width_m = self.size_m
        name = f"{self.id:018d}"
        return Track(
            agent_id=name, type=self.type, length_m=length_m, width_m=width_m, states=states
        )


class CommonRoad(LogReader):
    """The reader of CommonRoad XML."""

    name = "commonroad"
    title = "CommonRoad scenario, 2018b or 2020a (XML file)"
    suffix, marker = ".xml", b"<commonRoad"

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """One for each planning problem, and where there is none for each vehicle."""
        root, step_s = _root(path)
        doubts, left_out = Doubts(), Counter[str]()
        states = StateReader(root=root, step_s=step_s, doubts=doubts)
        things = (
            (element, states, left_out) for element in root if element.tag not in _OTHERS.split()
        )
        obstacles = doubts.read_all("objects", _obstacle, things)
        starts = ((element, states) for element in root.findall("planningProblem"))
        problems = doubts.read_all("planning problems", _problem, starts)
        vehicles = [who for who in obstacles if who.type is AgentType.VEHICLE and not who.stands]
        egos = {str(who.id): who for who in (*problems, *obstacles) if who.kind in DRIVERS}
        chosen = problems or vehicles or [_NOBODY]
        if item is not None:
            chosen = [foreign.look_up(egos, item, "item")]
        notes = [*note_left_out("objects", left_out), *doubts.notes]
        steps = 1 + max(max(participant.steps) for participant in (*obstacles, *chosen))
        benchmark = root.get("benchmarkID", path.stem)[:80]
        offer = ", ".join(f"{who.id} ({who.kind})" for who in [*egos.values()][:MOST_OFFERED])
        for ego in chosen:
            yield Log(
                times_s=np.arange(steps, dtype=np.float64) * step_s,
                ego=ego.track(steps).states,
                ego_size_m=ego.size_m,
                tracks=[obstacle.track(steps) for obstacle in obstacles if obstacle is not ego],
                map_at=lambda frame: read_network(root, frame),
                world=f"CommonRoad scenario frame of {benchmark}",
                title=f"CommonRoad scenario {benchmark}, ego {ego.id}",
                licence=root.get("source", "").strip()[:200] or "no source named",
                is_free=True,
                item=None if ego is _NOBODY else str(ego.id),
                frame=ego.steps[0],
                notes=[*notes, *(ASSUMED if ego.kind == PROBLEM else [])],
                no_ego=NO_EGO.format(offer or "nobody") if ego is _NOBODY else "",
            )


# Private


_NOBODY = Obstacle(
    id=0, kind="", size_m=(EGO_LENGTH_M, EGO_WIDTH_M), steps=[0], states=np.full((1, 4), np.nan)
)


def _root(path: Path) -> tuple[Element, float]:
    """The file and the seconds between its steps."""
    root = read_xml(path, what=foreign.WHAT)
    for element in root.iter():
        if len(element) and (text := (element.text or "").strip()):
            element.text = f"{text} <{element[0].tag}>"  # what goes on so is no number
    version = root.get("commonRoadVersion", "")
    if root.tag != "commonRoad" or version not in VERSIONS:
        text = f"is {root.tag[:40]!r} of version {version[:20]!r}, not commonRoad of"
        raise fault_at(path.name, f"{text} {' or '.join(VERSIONS)}")
    return root, foreign.read_number(root.get("timeStepSize"), "timeStepSize", 0.001, 10.0)


def _problem(element: Element, states: StateReader) -> Obstacle:
    place = f"planningProblem {element.get('id', '')[:20]}"
    steps, rows = states.read(element, place)
    number = foreign.read_whole(element.get("id"), place)
    return replace(_NOBODY, id=number, kind=PROBLEM, steps=steps, states=rows)


def _obstacle(element: Element, states: StateReader, left_out: Counter[str]) -> Obstacle | None:
    """Return the obstacle, None if it is left out."""
    kind = element.findtext("type", "").strip()
    place = f"{element.tag[:40]} {element.get('id', '')[:20]}"
    if {kind, element.tag} & {*SCENERY.split()}:
        left_out[kind or element.tag] += 1
        return None
    foreign.look_up(TYPE_OF, kind, place)
    role = element.findtext("role", element.tag.removesuffix("Obstacle")).strip()  # in 2018b
    stands = foreign.look_up({"static": True, "dynamic": False}, role, f"{place}.role")
    doubts = states.doubts
    if element.find("occupancySet") is not None:
        doubts.assume("Where somebody may be after t0 is no motion, and was left out")
    steps, rows = states.read(element, place, stands=stands)
    if not stands and len(steps) == 1:
        doubts.assume("Somebody who moves is known at the first step alone")
    box = doubts.read("shapes", read_box, element.find("shape"), place, doubts) or (0.0,) * 4
    cos, sin = np.cos(rows[:, 2]), np.sin(rows[:, 2])
    rows[:, 0] += box[0] * cos - box[1] * sin
    rows[:, 1] += box[0] * sin + box[1] * cos
    number = foreign.read_whole(element.get("id"), place)
    return Obstacle(id=number, kind=kind, size_m=box[2:], steps=steps, states=rows, stands=stands)
