"""Lanelets, signs, lights and intersections of CommonRoad XML as segments and areas.

What an intersection names as the successors of its incoming lanelets lies in it, and what follows
these in a bend. In a file without intersections, lanelets of forks and merges that cross others
do. Turn types are those that it names; a light holds for the ways in its direction.
"""

import math
from collections import Counter
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.road_map import (
    FURTHEST_M,
    FloatArray,
    RoadMap,
    Segment,
    crossing_segments,
    map_notes,
)
from augment.formats.roads import midline
from augment.geometry.polyline import Polyline
from augment.scene.entities import AreaKind, TrafficLight, TurnType
from augment.scene.lane_graph import turn_type_of
from augment.scene.recording import SceneNoteKind

WHAT = "CommonRoad scenario"
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
COLOURS = {
    "green": TrafficLight.GREEN,
    "yellow": TrafficLight.YELLOW,
    "red": TrafficLight.RED,
    "redYellow": TrafficLight.RED,
    "inactive": TrafficLight.UNKNOWN,
}
_TURNS = {"Straight": TurnType.STRAIGHT, "Left": TurnType.LEFT, "Right": TurnType.RIGHT}
"""By the ends of an incoming's children; a light's direction has the same words."""


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
        """Return whether a way of that turn obeys this light."""
        words = [word.lower() for word, kind in _TURNS.items() if kind is turn]
        if not words or self.direction in ("", "all"):
            return True
        return words[0] in self.direction.lower()

    def state_at(self, step: int) -> TrafficLight:
        """Return the colour at a time step."""
        steps = [colour for colour, duration in self.cycle for _ in range(duration)]
        if not self.is_active or not steps:
            return TrafficLight.UNKNOWN
        return steps[(step - self.offset) % len(steps)]


# Numbers and references


def fault(place: str, text: str) -> InvalidDocument:
    """Return the error of what is wrong, and where."""
    return InvalidDocument(WHAT, [(place, text)])


def whole(text: str | None, place: str) -> int:
    """Return a whole number such as an id.

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


def real(text: str | None, place: str) -> float:
    """Return a finite number.

    Raises:
        InvalidDocument: It is none.
    """
    given = text or ""
    try:
        number = float(given.strip())
    except ValueError:
        number = math.nan
    if not abs(number) <= FURTHEST_M:
        raise fault(place, f"expected a finite number up to {FURTHEST_M:.0e}, got {given[:40]!r}")
    return number


def points_of(parent: Element, place: str) -> FloatArray:
    """Return the points (P, 2) of a bound or polygon.

    Raises:
        InvalidDocument: A coordinate is missing or no number.
    """
    rows = [point_of(point, place) for point in parent.findall("point")]
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def point_of(point: Element, place: str) -> tuple[float, float]:
    """Return x and y of a point.

    Raises:
        InvalidDocument: One is missing or no number.
    """
    return real(point.findtext("x"), place), real(point.findtext("y"), place)


def _references(parent: Element, name: str) -> tuple[int, ...]:
    return tuple(whole(one.get("ref"), f"{parent.tag}.{name}") for one in parent.findall(name))


# The map


def network_of(root: Element, step: int) -> RoadMap:
    """Return the map with the lights at one time step.

    Raises:
        InvalidDocument: A lanelet, sign or light breaks the format.
    """
    limits, other_signs = _limits(root)
    lights = dict(_light(element) for element in root.findall("trafficLight"))
    elements = {whole(one.get("id"), "lanelet"): one for one in root.findall("lanelet")}
    kinds = {
        key: {(kind.text or "").strip() for kind in one.findall("laneletType")}
        for key, one in elements.items()
    }
    lanelets = {key: _segment(key, one, limits) for key, one in elements.items()}
    inside = _inside(root, lanelets, {key for key in kinds if "intersection" in kinds[key]})
    segments = []
    for key, one in lanelets.items():
        if kinds[key] & (AREA_OF.keys() | LEFT_OUT):
            continue
        light, turn = TrafficLight.NONE, inside.get(key)
        if key in inside:  # its own light, or that of the lanelets before it
            before = [elements[name] for name in one.predecessors if name in elements]
            named = [
                n for e in (elements[key], *before) for n in _references(e, "trafficLightRef")
            ]
            shown = [lights[n] for n in named if n in lights and lights[n].holds_for(turn)]
            light = shown[0].state_at(step) if shown else light
        segments.append(replace(one, crosses=key in inside, turn=turn, light=light))
    if not inside:  # the dialect of 2018b has no intersections
        crossing = crossing_segments({one.name: one for one in segments})
        segments = [replace(one, crosses=one.name in crossing) for one in segments]
    areas = tuple(
        (AREA_OF[kind], np.vstack([one.left, one.right[::-1]]))
        for key, one in lanelets.items()
        for kind in sorted(kinds[key] & AREA_OF.keys())[:1]
        if one.left is not None and one.right is not None
    )
    return RoadMap(
        what=WHAT,
        place="lanelet",
        segments=tuple(segments),
        areas=areas,
        notes=map_notes(
            segments,
            there={
                SceneNoteKind.NO_INTERSECTIONS: any(one.crosses for one in segments),
                SceneNoteKind.NO_WALKWAYS: AreaKind.WALKWAY in {kind for kind, _ in areas},
            },
            counts={
                SceneNoteKind.LIGHTS_REPEATED: len(lights),
                SceneNoteKind.BICYCLE_LANES_LEFT_OUT: sum(
                    "bicycleLane" in one for one in kinds.values()
                ),
            },
            left_out=other_signs,
        ),
    )


def _limits(root: Element) -> tuple[dict[int, float], Counter[str]]:
    """The limit of each sign that is one, and the other signs."""
    limits: dict[int, float] = {}
    others: Counter[str] = Counter()
    for sign in root.findall("trafficSign"):
        sign_id = whole(sign.get("id"), "trafficSign")
        for element in sign.findall("trafficSignElement"):
            name = element.findtext("trafficSignID", "").strip()
            value = element.findtext("additionalValue")
            if name in SPEED_SIGNS and value is not None:
                limits[sign_id] = real(value, f"trafficSign {sign_id}")
            else:
                others[f"sign {name[:20]}"] += 1
    return limits, others


def _light(element: Element) -> tuple[int, Light]:
    light_id = whole(element.get("id"), "trafficLight")
    place = f"trafficLight {light_id}"
    cycle = []
    for part in element.findall("cycle/cycleElement"):
        colour = part.findtext("color", "").strip()
        steps = whole(part.findtext("duration"), f"{place}.duration")
        if colour not in COLOURS:
            raise fault(place, f"unknown colour {colour[:20]!r}; known: {', '.join(COLOURS)}")
        if not 0 <= steps <= 100_000:
            raise fault(place, f"a duration of {steps} steps is none")
        cycle.append((COLOURS[colour], steps))
    return light_id, Light(
        cycle=tuple(cycle),
        offset=whole(element.findtext("cycle/timeOffset", "0"), f"{place}.timeOffset"),
        direction=element.findtext("direction", "").strip(),
        is_active=element.findtext("active", "").strip() != "false",
    )


def _segment(key: int, element: Element, limits: dict[int, float]) -> Segment:
    place = f"lanelet {key}"
    left, right = element.find("leftBound"), element.find("rightBound")
    if left is None or right is None:
        raise fault(place, "needs a leftBound and a rightBound")
    edges = points_of(left, place), points_of(right, place)
    signs = _references(element, "trafficSignRef")
    known = [limits[sign] for sign in signs if sign in limits]
    known += [real(one.text, f"{place}.speedLimit") for one in element.findall("speedLimit")]
    # The format pairs the points of the bounds; the middle of each pair is on the centreline.
    is_paired = len(edges[0]) == len(edges[1])
    return Segment(
        name=key,
        centerline=(edges[0] + edges[1]) / 2.0 if is_paired else None,
        left=edges[0],
        right=edges[1],
        successors=_references(element, "successor"),
        predecessors=_references(element, "predecessor"),
        left_neighbors=_references(element, "adjacentLeft[@drivingDir='same']"),
        right_neighbors=_references(element, "adjacentRight[@drivingDir='same']"),
        speed_limit_mps=min((limit for limit in known if 0.0 < limit <= 100.0), default=None),
    )


def _inside(
    root: Element, lanelets: dict[int, Segment], marked: set[int]
) -> dict[int, TurnType | None]:
    """What lies in an intersection, with its turn where the file tells it."""
    named: dict[int, TurnType | None] = dict.fromkeys(marked)
    for incoming in root.findall("intersection/incoming"):
        for word, turn in _TURNS.items():
            named |= dict.fromkeys(_references(incoming, f"successors{word}"), turn)
    inside = {key: turn for key, turn in named.items() if key in lanelets}
    # Where the file says itself what is an intersection, no bend has to tell.
    waiting = [] if marked else list(inside)
    while waiting:
        for name in lanelets[waiting.pop()].successors:
            key = int(name)
            if key not in lanelets or key in inside:
                continue
            one = lanelets[key]
            enters = set(one.predecessors) <= inside.keys()
            if enters and one.successors and _bends(one):
                inside[key] = None
                waiting.append(key)
    return inside


def _bends(one: Segment) -> bool:
    assert one.left is not None
    assert one.right is not None
    try:
        line = midline(Polyline(one.left), Polyline(one.right))
    except ValueError:
        return False  # it is refused where the road is built
    return turn_type_of(line) is not TurnType.STRAIGHT
