"""Lanelets, signs, lights and intersections as segments and areas.

What an intersection names as the successors of its incoming lanelets lies in it, and what follows
these in a bend. In a file without intersections, lanelets of forks and merges that cross others
do. Turn types are those that it names; a light holds for the ways in its direction.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.documents import Element
from augment.formats.road_map import (
    FURTHEST_M,
    FloatArray,
    RoadMap,
    Segment,
    count_notes,
    crossing_segments,
    left_out_notes,
    limit_notes,
)
from augment.formats.roads import midline
from augment.geometry.polyline import Polyline
from augment.scene.entities import AreaKind, TrafficLight, TurnType
from augment.scene.lane_graph import turn_type_of
from augment.scene.recording import Note, SceneNoteKind

WHAT = "CommonRoad scenario"


def fault(place: str, text: str) -> InvalidDocument:
    """What is wrong, and where."""
    return InvalidDocument(WHAT, [(place, text)])


def whole(text: str | None, place: str) -> int:
    """A whole number such as an id.

    Raises:
        InvalidDocument: It is none.
    """
    try:
        number = int((text or "").strip())
    except ValueError:
        raise fault(place, f"expected a whole number, got {(text or '')[:40]!r}") from None
    if abs(number) > 10**15:
        raise fault(place, f"{str(number)[:20]}... is too large")
    return number


def real(text: str, place: str) -> float:
    """A finite number.

    Raises:
        InvalidDocument: It is none.
    """
    try:
        number = float(text.strip())
    except ValueError:
        number = math.nan
    if not abs(number) <= FURTHEST_M:
        raise fault(place, f"expected a finite number up to {FURTHEST_M:.0e}, got {text[:40]!r}")
    return number


def value_of(parent: Element, name: str, place: str) -> float | None:
    """A value given exactly or as an interval, whose middle is taken; None where it is not given.

    Raises:
        InvalidDocument: It is no number.
    """
    element = parent.first(name)
    if element is None:
        return None
    exact = element.first("exact")
    if exact is not None:
        return real(exact.text, f"{place}.{name}")
    low, high = element.first("intervalStart"), element.first("intervalEnd")
    if low is not None and high is not None:
        ends = (real(low.text, f"{place}.{name}"), real(high.text, f"{place}.{name}"))
        return sum(ends) / 2.0
    return real(element.text, f"{place}.{name}")


def points_of(parent: Element, place: str) -> NDArray[np.float64]:
    """The points (P, 2) of a bound or polygon."""
    rows = [point_of(point, place) for point in parent.all("point")]
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def point_of(point: Element, place: str) -> tuple[float, float]:
    """X and y of a point.

    Raises:
        InvalidDocument: One is missing or no number.
    """
    x, y = point.first("x"), point.first("y")
    if x is None or y is None:
        raise fault(place, "a point needs x and y")
    return real(x.text, place), real(y.text, place)


def references(parent: Element, *names: str) -> Iterator[int]:
    """The ids that children of these names refer to."""
    for child in parent.all(*names):
        yield whole(child.attributes.get("ref"), f"{parent.name}.{child.name}")


COLOURS = {
    "green": TrafficLight.GREEN,
    "yellow": TrafficLight.YELLOW,
    "red": TrafficLight.RED,
    "redYellow": TrafficLight.RED,
    "inactive": TrafficLight.UNKNOWN,
}
_DIRECTIONS = {TurnType.LEFT: "left", TurnType.RIGHT: "right", TurnType.STRAIGHT: "straight"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """One light.

    Attributes:
        cycle: Colour and steps, in order.
        offset: The step at which the cycle begins.
        direction: "all", or words like "leftStraight".
    """

    cycle: tuple[tuple[TrafficLight, int], ...]
    offset: int
    direction: str
    is_active: bool

    def holds_for(self, turn: TurnType | None) -> bool:
        """Whether a way of that turn obeys this light."""
        if turn is None or self.direction in ("", "all") or turn not in _DIRECTIONS:
            return True
        return _DIRECTIONS[turn] in self.direction.lower()

    def state_at(self, step: int) -> TrafficLight:
        """The colour at a time step."""
        total = sum(duration for _, duration in self.cycle)
        if not self.is_active or total == 0:
            return TrafficLight.UNKNOWN
        place = (step - self.offset) % total
        for colour, duration in self.cycle:
            if place < duration:
                return colour
            place -= duration
        raise AssertionError("a place in a cycle lies in one of its parts")


def lights_of(root: Element) -> dict[int, Light]:
    """Every light by its id.

    Raises:
        InvalidDocument: A colour or a duration breaks the format.
    """
    lights = {}
    for element in root.all("trafficLight"):
        light_id = whole(element.attributes.get("id"), "trafficLight")
        place = f"trafficLight {light_id}"
        cycle = element.first("cycle")
        parts: list[tuple[TrafficLight, int]] = []
        offset = 0
        if cycle is not None:
            parts = [_part(one, place) for one in cycle.all("cycleElement")]
            given = cycle.first("timeOffset")
            offset = 0 if given is None else whole(given.text, f"{place}.timeOffset")
        direction, active = element.first("direction"), element.first("active")
        lights[light_id] = Light(
            cycle=tuple(parts),
            offset=offset,
            direction="" if direction is None else direction.text.strip(),
            is_active=active is None or active.text.strip() != "false",
        )
    return lights


def _part(element: Element, place: str) -> tuple[TrafficLight, int]:
    colour, duration = element.first("color"), element.first("duration")
    text = "" if colour is None else colour.text.strip()
    if text not in COLOURS:
        allowed = ", ".join(COLOURS)
        raise fault(place, f"unknown colour {text[:20]!r}; known: {allowed}")
    steps = whole(None if duration is None else duration.text, f"{place}.duration")
    if steps < 0:
        raise fault(place, f"a duration of {steps} steps is none")
    return COLOURS[text], steps


SPEED_SIGNS = frozenset({"274", "R2-1"})
"""The speed limit of Germany (and of Zamunda), and of the United States; values in m/s."""

AREA_OF = {
    "sidewalk": AreaKind.WALKWAY,
    "crosswalk": AreaKind.CROSSWALK,
    "shoulder": AreaKind.DRIVABLE,
    "busStop": AreaKind.DRIVABLE,
    "parking": AreaKind.CARPARK,
}
LEFT_OUT = frozenset({"bicycleLane", "border", "restricted"})
_TURNS = {
    "successorsStraight": TurnType.STRAIGHT,
    "successorsLeft": TurnType.LEFT,
    "successorsRight": TurnType.RIGHT,
}


@dataclass(slots=True, eq=False)
class Lanelet:
    """A lanelet as it stands in the file."""

    id: int
    left: FloatArray
    right: FloatArray
    kinds: frozenset[str]
    limit_mps: float | None
    predecessors: tuple[int, ...]
    successors: tuple[int, ...]
    lights: tuple[int, ...]
    left_neighbors: tuple[int, ...]
    right_neighbors: tuple[int, ...]


def network_of(root: Element, step: int) -> RoadMap:
    """The map with the lights at one time step.

    Raises:
        InvalidDocument: A lanelet, sign or light breaks the format.
    """
    limits, other_signs = _limits(root)
    lanelets = {one.id: one for one in (_lanelet(e, limits) for e in root.all("lanelet"))}
    inside = _inside(root, lanelets)
    lights = lights_of(root)
    roads = {
        key: one for key, one in lanelets.items() if not one.kinds & (AREA_OF.keys() | LEFT_OUT)
    }
    segments = tuple(
        _segment(one, key in inside, inside.get(key), _state(one, lanelets, inside, lights, step))
        for key, one in roads.items()
    )
    areas = tuple(
        (AREA_OF[kind], np.vstack([lanelet.left, lanelet.right[::-1]]))
        for lanelet in lanelets.values()
        for kind in sorted(lanelet.kinds & AREA_OF.keys())[:1]
    )
    if not inside:  # the dialect of 2018b has no intersections
        crossing = crossing_segments({one.name: one for one in segments})
        segments = tuple(replace(one, crosses=one.name in crossing) for one in segments)
    notes = _notes(segments, areas, len(lights), other_signs, lanelets)
    return RoadMap(what=WHAT, place="lanelet", segments=segments, areas=areas, notes=tuple(notes))


# Private


def _limits(root: Element) -> tuple[dict[int, float], Counter[str]]:
    """The limit of each sign that is one, and the other signs."""
    limits: dict[int, float] = {}
    others: Counter[str] = Counter()
    for sign in root.all("trafficSign"):
        sign_id = whole(sign.attributes.get("id"), "trafficSign")
        for element in sign.all("trafficSignElement"):
            name, value = element.first("trafficSignID"), element.first("additionalValue")
            text = "" if name is None else name.text.strip()
            if text in SPEED_SIGNS and value is not None:
                limits[sign_id] = real(value.text, f"trafficSign {sign_id}")
            else:
                others[text[:20]] += 1
    return limits, others


def _lanelet(element: Element, limits: dict[int, float]) -> Lanelet:
    lanelet_id = whole(element.attributes.get("id"), "lanelet")
    place = f"lanelet {lanelet_id}"
    left, right = element.first("leftBound"), element.first("rightBound")
    if left is None or right is None:
        raise fault(place, "needs a leftBound and a rightBound")
    given = element.first("speedLimit")
    known = [limits[sign] for sign in references(element, "trafficSignRef") if sign in limits]
    if given is not None:
        known.append(real(given.text, f"{place}.speedLimit"))
    known = [limit for limit in known if 0.0 < limit <= 100.0]
    return Lanelet(
        id=lanelet_id,
        left=points_of(left, place),
        right=points_of(right, place),
        kinds=frozenset(kind.text.strip() for kind in element.all("laneletType")),
        limit_mps=min(known, default=None),
        predecessors=tuple(references(element, "predecessor")),
        successors=tuple(references(element, "successor")),
        lights=tuple(references(element, "trafficLightRef")),
        left_neighbors=_beside(element, "adjacentLeft"),
        right_neighbors=_beside(element, "adjacentRight"),
    )


def _beside(element: Element, name: str) -> tuple[int, ...]:
    return tuple(
        whole(child.attributes.get("ref"), name)
        for child in element.all(name)
        if child.attributes.get("drivingDir") == "same"
    )


def _inside(root: Element, lanelets: dict[int, Lanelet]) -> dict[int, TurnType | None]:
    """What lies in an intersection, with its turn where the file tells it."""
    inside: dict[int, TurnType | None] = {
        key: None for key, one in lanelets.items() if "intersection" in one.kinds
    }
    for intersection in root.all("intersection"):
        for incoming in intersection.all("incoming"):
            for name, turn in _TURNS.items():
                inside |= dict.fromkeys(references(incoming, name), turn)
    inside = {key: turn for key, turn in inside.items() if key in lanelets}
    # Where the file says itself what is an intersection, no bend has to tell.
    waiting = (
        []
        if any("intersection" in lanelet.kinds for lanelet in lanelets.values())
        else list(inside)
    )
    while waiting:
        for key in lanelets[waiting.pop()].successors:
            one = lanelets.get(key)
            if one is None or key in inside or not set(one.predecessors) <= inside.keys():
                continue
            if one.successors and _bends(one):
                inside[key] = None
                waiting.append(key)
    return inside


def _bends(one: Lanelet) -> bool:
    try:
        line = midline(Polyline(one.left), Polyline(one.right))
    except ValueError:
        return False  # it is refused where the road is built
    return turn_type_of(line) is not TurnType.STRAIGHT


def _state(
    one: Lanelet,
    lanelets: dict[int, Lanelet],
    inside: dict[int, TurnType | None],
    lights: dict[int, Light],
    step: int,
) -> TrafficLight:
    """The light for a way through an intersection: its own, or of the lanelets before it."""
    if one.id not in inside:
        return TrafficLight.NONE
    before = [lanelets[key] for key in one.predecessors if key in lanelets]
    names = [name for lanelet in (one, *before) for name in lanelet.lights]
    turn = inside[one.id]
    for name in names:
        light = lights.get(name)
        if light is not None and light.holds_for(turn):
            return light.state_at(step)
    return TrafficLight.NONE


def _segment(one: Lanelet, crosses: bool, turn: TurnType | None, light: TrafficLight) -> Segment:
    # The format pairs the points of the bounds; the middle of each pair is on the centreline.
    paired = len(one.left) == len(one.right)
    return Segment(
        name=one.id,
        crosses=crosses,
        centerline=(one.left + one.right) / 2.0 if paired else None,
        left=one.left,
        right=one.right,
        successors=one.successors,
        predecessors=one.predecessors,
        left_neighbors=one.left_neighbors,
        right_neighbors=one.right_neighbors,
        speed_limit_mps=one.limit_mps,
        light=light,
        turn=turn,
    )


def _notes(
    segments: Sequence[Segment],
    areas: Sequence[tuple[AreaKind, FloatArray]],
    lights: int,
    other_signs: Counter[str],
    lanelets: dict[int, Lanelet],
) -> Iterator[Note]:
    yield from limit_notes(segments)
    if not any(one.crosses for one in segments):
        yield Note(kind=SceneNoteKind.NO_INTERSECTIONS)
    bicycle_lanes = sum("bicycleLane" in lanelet.kinds for lanelet in lanelets.values())
    yield from count_notes(
        {
            SceneNoteKind.LIGHTS_REPEATED: lights,
            SceneNoteKind.BICYCLE_LANES_LEFT_OUT: bicycle_lanes,
        }
    )
    signs = {f"sign {name}": number for name, number in other_signs.items()}
    yield from left_out_notes(SceneNoteKind.MAP_PARTS_LEFT_OUT, signs)
    if not any(kind is AreaKind.WALKWAY for kind, _ in areas):
        yield Note(kind=SceneNoteKind.NO_WALKWAYS)
