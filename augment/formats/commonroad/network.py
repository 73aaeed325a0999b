"""Lanelets, signs, lights and intersections of CommonRoad XML as segments and areas.

What an intersection names as the successors of its incoming lanelets lies in it. In a file
without intersections, lanelets of forks and merges that cross others do. Turn types are those
that it names; a light holds for the ways in its direction.
"""

import math
from collections import Counter
from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np

from augment.formats.road_map import RoadMap, Segment
from augment.formats.values import FURTHEST, FloatArray, fault_at, look_up, read_finite
from augment.scene.entities import AreaKind, TrafficLight, TurnType

SPEED_SIGNS = frozenset({"274", "R2-1"})
"""The speed limit of Germany (and of Zamunda), and of the United States; values in m/s."""
AREA_OF = {
    "sidewalk": AreaKind.WALKWAY,
    "crosswalk": AreaKind.CROSSWALK,
    "shoulder": AreaKind.DRIVABLE,
    "busStop": AreaKind.DRIVABLE,
    "parking": AreaKind.CARPARK,
}
LEFT_OUT = {"bicycleLane": "bicycle lanes", "border": "borders", "restricted": "restricted lanes"}
COLOURS = {
    "green": TrafficLight.GREEN,
    "yellow": TrafficLight.YELLOW,
    "red": TrafficLight.RED,
    "redYellow": TrafficLight.RED,
    "inactive": TrafficLight.UNKNOWN,
}
_TURNS = {"Straight": TurnType.STRAIGHT, "Left": TurnType.LEFT, "Right": TurnType.RIGHT}
"""By the ends of an incoming's children; a light's direction has the same words."""


# Numbers and references


def whole(text: str | None, place: str) -> int:
    """Return a whole number such as an id.

    Raises:
        InvalidDocument: It is none.
    """
    given = (text or "").strip()
    if len(given) <= 15 and given.removeprefix("-").isdecimal():
        return int(given)
    raise fault_at(place, f"expected a whole number, got {given[:40]!r}")


def real(text: str | None, place: str) -> float:
    """Return a finite number.

    Raises:
        InvalidDocument: It is none.
    """
    try:
        number = float(text or "")
    except ValueError:
        number = math.nan
    if not abs(number) <= FURTHEST:
        raise fault_at(place, f"expected a finite number, got {(text or '')[:40]!r}")
    return number


def points_of(parent: Element, place: str) -> FloatArray:
    """Return the points (P, 2) of a bound or polygon.

    Raises:
        InvalidDocument: A coordinate is missing or no number.
    """
    points = parent.findall("point")
    return read_finite([(one.findtext("x"), one.findtext("y")) for one in points], place, 2)


def _references(parent: Element, name: str) -> tuple[int, ...]:
    return tuple(whole(one.get("ref"), f"{parent.tag}.{name}") for one in parent.findall(name))


# The map


def network_of(root: Element, step: int) -> RoadMap:
    """Return the map with the lights at one time step.

    Raises:
        InvalidDocument: A lanelet, sign or light breaks the format.
    """
    limits, left_out = _limits(root)
    lights = dict(_light(element, step) for element in root.findall("trafficLight"))
    elements = {whole(one.get("id"), "lanelet"): one for one in root.findall("lanelet")}
    kinds = {
        key: {(kind.text or "").strip() for kind in one.findall("laneletType")}
        for key, one in elements.items()
    }
    lanelets = {key: _segment(key, one, limits) for key, one in elements.items()}
    inside = _inside(root, {key for key in kinds if "intersection" in kinds[key]})
    segments, areas = [], []
    for key, one in lanelets.items():
        for kind in sorted(kinds[key] & AREA_OF.keys())[:1]:
            areas.append((AREA_OF[kind], np.vstack([one.left, one.right[::-1]])))  # type: ignore[list-item,index]
        for kind in kinds[key] & LEFT_OUT.keys():
            left_out[LEFT_OUT[kind]] += 1
        if kinds[key] & (AREA_OF.keys() | LEFT_OUT.keys()):
            continue
        light, turn = TrafficLight.NONE, inside.get(key)
        if key in inside:  # its own light, or that of the lanelets before it
            before = [elements[name] for name in one.predecessors if name in elements]
            named = [
                n for e in (elements[key], *before) for n in _references(e, "trafficLightRef")
            ]
            known = [lights[number] for number in named if number in lights]
            shown = [colour for colour, way in known if _holds_for(way, turn)]
            light = shown[0] if shown else light
        segments.append(replace(one, crosses=key in inside, turn=turn, light=light))
    return RoadMap(
        place="lanelet",
        segments=tuple(segments),
        areas=tuple(areas),
        left_out=left_out,
        tells_crossings=any(
            one.crosses for one in segments
        ),  # the dialect of 2018b has no intersections
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


def _light(element: Element, step: int) -> tuple[int, tuple[TrafficLight, str]]:
    """The number of a light, its colour at a time step, and the direction that it is for."""
    light_id = whole(element.get("id"), "trafficLight")
    place = f"trafficLight {light_id}"
    cycle: list[TrafficLight] = []
    for part in element.findall("cycle/cycleElement"):
        colour = look_up(COLOURS, part.findtext("color", "").strip(), place)
        steps = whole(part.findtext("duration"), f"{place}.duration")
        if not 0 <= steps <= 100_000:
            raise fault_at(place, f"a duration of {steps} steps is none")
        cycle += [colour] * steps
    offset = whole(element.findtext("cycle/timeOffset", "0"), f"{place}.timeOffset")
    is_off = element.findtext("active", "").strip() == "false" or not cycle
    shown = TrafficLight.UNKNOWN if is_off else cycle[(step - offset) % len(cycle)]
    return light_id, (shown, element.findtext("direction", "").strip())


def _holds_for(direction: str, turn: TurnType | None) -> bool:
    """Whether a way of that turn obeys a light: "all", or words like "leftStraight"."""
    words = [word.lower() for word, kind in _TURNS.items() if kind is turn]
    return not words or direction in ("", "all") or words[0] in direction.lower()


def _segment(key: int, element: Element, limits: dict[int, float]) -> Segment:
    place = f"lanelet {key}"
    left, right = element.find("leftBound"), element.find("rightBound")
    if left is None or right is None:
        raise fault_at(place, "needs a leftBound and a rightBound")
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


def _inside(root: Element, marked: set[int]) -> dict[int, TurnType | None]:
    """What lies in an intersection, with its turn where the file tells it."""
    named: dict[int, TurnType | None] = dict.fromkeys(marked)
    for incoming in root.findall("intersection/incoming"):
        for word, turn in _TURNS.items():
            named |= dict.fromkeys(_references(incoming, f"successors{word}"), turn)
    return named
