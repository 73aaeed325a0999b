"""Lanelets, signs, lights and intersections of CommonRoad XML as segments and areas.

What an intersection names as the successors of its incoming lanelets lies in it, and so do the
other successors of these. In a file without intersections, lanelets of forks and merges that cross
others do. What follows a lanelet with a light does in any case. Turn types are those that the
intersection names; a light holds for the ways in its direction.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import Doubts, FloatArray, Value, fault_at
from augment.formats.road_map import Name, RoadMap, Segment, crossing_segments, find_successors
from augment.formats.roads import refuse_shape, segment_centreline
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType
from augment.scene.lane_graph import classify_turn

SPEED_SIGNS = "274 274.1 R2-1 R301 3.24 R15 C43 B14 Ρ-32 P-32 R-32 B31 R4-1"
"""Highest speeds, values in m/s: of Germany and the countries without signs of their own (a zone
too), the United States, Spain, Russia, Argentina, Belgium, France, Greece, Croatia, Australia."""
LEFT_HAND = (
    "AIA ATG AUS BGD BHS BMU BRB BRN BTN BWA CCK COK CXR CYM CYP DMA FJI FLK GBR GGY GRD GUY HKG "
    "IDN IMN IND IRL JAM JEY JPN KEN KIR KNA LCA LKA LSO MAC MDV MLT MOZ MSR MUS MWI MYS NAM NFK "
    "NIU NPL NRU NZL PAK PNG SGP SHN SLB SUR SWZ SYC TCA THA TKL TLS TON TTO TUV TZA UGA VCT VGB "
    "VIR WSM ZAF ZMB ZWE"
)
"""Countries of benchmark ids (ISO 3166-1 alpha-3) in which people drive on the left."""
AREA_OF = {
    "sidewalk": AreaKind.WALKWAY,
    "crosswalk": AreaKind.CROSSWALK,
    "shoulder": AreaKind.DRIVABLE,
    "busStop": AreaKind.DRIVABLE,
    "parking": AreaKind.CARPARK,
}
LEFT_OUT = {"bicycleLane": "bicycle lanes", "border": "borders"} | dict.fromkeys(
    ("restricted", "restricted_area"), "restricted lanes"
)
_DRIVEN = (
    "urban interstate country highway busLane exitRamp mainCarriageWay accessRamp driveWay "
    "intersection unknown"
)
_TYPES = dict.fromkeys((*_DRIVEN.split(), *AREA_OF, *LEFT_OUT))
_WAYS = dict.fromkeys(("same", "opposite"))
_USERS = {"bicycle": "bicycleLane", "pedestrian": "sidewalk"} | dict.fromkeys(
    ("vehicle", "car", "truck", "bus", "priorityVehicle", "motorcycle", "taxi", "train"), ""
)
"""Who may use a lanelet, and what it is for the type of one that is theirs alone."""
COLOURS = {
    "green": TrafficLight.GREEN,
    "yellow": TrafficLight.YELLOW,
    "red": TrafficLight.RED,
    "redYellow": TrafficLight.RED,
    "inactive": TrafficLight.UNKNOWN,
}
_TURNS = {"Straight": TurnType.STRAIGHT, "Left": TurnType.LEFT, "Right": TurnType.RIGHT}
"""By the ends of an incoming's children, which begin with successors or, later, outgoing."""
Light = tuple[TrafficLight, set[TurnType]]
"""Its colour, and the turns of the ways that it is for."""
_DARK: Light = (TrafficLight.UNKNOWN, {*_TURNS.values()})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lanelet:
    """A lanelet as it stands in the file, without what intersections and lights say of it.

    Attributes:
        turn: What its shape says.
        lights: The numbers of those that it or its stop line names.
        outline: (P, 2) around it.
    """

    segment: Segment
    turn: TurnType
    kinds: set[str]
    lights: set[int]
    outline: FloatArray


def read_points(parent: Element, place: str) -> FloatArray:
    """Return the points (P, 2) of a bound or polygon.

    Raises:
        InvalidDocument: A coordinate is missing or no number.
    """
    rows = [(point.findtext("x"), point.findtext("y")) for point in parent.findall("point")]
    return foreign.read_finite(rows, place, 2)


def read_network(root: Element, step: int) -> RoadMap:
    """Return the map with the lights at one time step."""
    doubts, left_out = Doubts(), Counter[str]()

    def read_by_id(tag: str, read: Callable[..., Value], *more: Any) -> dict[int, Value]:
        def read_pair(element: Element) -> tuple[int, Value]:
            number = foreign.read_whole(element.get("id"), f"{tag}.id")
            return number, read(element, f"{tag} {number}", doubts, *more)

        pairs = doubts.read_all(f"{tag}s", read_pair, ((part,) for part in root.findall(tag)))
        return doubts.index_last(f"{tag}s", pairs)

    limits = read_by_id("trafficSign", _limit, left_out)
    lights = read_by_id("trafficLight", _light, step)
    driven, areas = dict[Name, Lanelet](), []
    for name, lanelet in read_by_id("lanelet", _lanelet, limits).items():
        for kind in sorted(lanelet.kinds & AREA_OF.keys())[:1]:
            areas.append((AREA_OF[kind], lanelet.outline))
        left_out.update(LEFT_OUT[kind] for kind in lanelet.kinds & LEFT_OUT.keys())
        if not lanelet.kinds & (AREA_OF.keys() | LEFT_OUT.keys()):
            driven[name] = lanelet
    segments = {name: lanelet.segment for name, lanelet in driven.items()}
    inside = dict.fromkeys(
        name for name, lanelet in driven.items() if "intersection" in lanelet.kinds
    )
    inside |= _find_inside(root, segments, doubts)
    inside = inside or dict.fromkeys(crossing_segments(segments))
    shown = _show_lights(driven, inside, lights, doubts)
    for key, segment in segments.items():
        light, turn = shown.get(key, TrafficLight.NONE), inside.get(key)
        segments[key] = replace(segment, crosses=key in inside, turn=turn, light=light)
    country = root.get("benchmarkID", "").upper().removeprefix("C-")[:3]
    is_left = country in LEFT_HAND.split()
    return RoadMap(
        place="lanelet",
        segments=tuple(segments.values()),
        areas=tuple(areas),
        side=TrafficSide.LEFT if is_left else TrafficSide.RIGHT,
        side_reason=f", from the country {country} in the scenario's id" if is_left else "",
        left_out=left_out,
        doubts=doubts,
    )


# Signs and lights


def _limit(sign: Element, place: str, doubts: Doubts, left_out: Counter[str]) -> float | None:
    """The limit of a sign that is one; other signs are left out."""
    limits = []
    for element in sign.findall("trafficSignElement"):
        name = element.findtext("trafficSignID", "").strip().upper()
        value = element.find("additionalValue")
        if name in SPEED_SIGNS.split() and value is not None:
            limits.append((value.text or "", place))
        else:
            left_out[f"sign {name[:20]}"] += 1
    return min(doubts.read_all("speed limits", foreign.read_speed, limits), default=None)


def _light(element: Element, place: str, doubts: Doubts, step: int) -> Light:
    """The colour of a light at a time step, and the turns that it is for."""
    direction = element.findtext("direction", "").strip()
    turns, colour = _DARK[1], None
    if direction not in ("", "all"):
        words = re.findall("[A-Z]?[a-z]+|[^a-z]+", direction)
        rows = ((_TURNS, word.capitalize(), place) for word in words)
        turns = {*doubts.read_all("directions of lights", foreign.look_up, rows)} or turns
    with doubts.about("states of lights"):
        active = element.findtext("active", "true").strip()
        if foreign.look_up({"true": True, "1": True, "false": False, "0": False}, active, place):
            colour = _colour(element, step, place)
    if colour is None:
        doubts.assume("A light that is off, or has no cycle, is of unknown state")
    return colour or TrafficLight.UNKNOWN, turns


def _colour(element: Element, step: int, place: str) -> TrafficLight | None:
    """The colour at a time step; None without a cycle."""
    cycle: list[TrafficLight] = []
    for part in element.findall("cycle/*"):
        if part.tag == "timeOffset":
            step -= foreign.read_whole(part.text, f"{place}.timeOffset")
            continue
        colour = foreign.look_up(COLOURS, part.findtext("color", "").strip(), place)
        steps = foreign.read_whole(part.findtext("duration"), f"{place}.duration")
        if not 0 <= steps <= 100_000:
            raise fault_at(place, f"a duration of {steps} steps is none")
        cycle += [colour] * steps
    return cycle[step % len(cycle)] if cycle else None


def _show_lights(
    lanelets: Mapping[Name, Lanelet],
    inside: dict[Name, TurnType | None],
    lights: Mapping[int, Light],
    doubts: Doubts,
) -> dict[Name, TrafficLight]:
    """Return the colour for each lanelet that a light governs, and put it inside.

    Of several lanelets in a row with one light, the last leads into the intersection.
    """
    following = find_successors({name: lanelet.segment for name, lanelet in lanelets.items()})
    governing = {name: {*lanelets[name].lights} for name in lanelets if name in inside}
    for name, lanelet in lanelets.items():
        for after in following[name] if lanelet.lights and name not in inside else ():
            if after in inside or not lanelet.lights & lanelets[after].lights:
                governing[after] = governing.get(after, set()) | lanelet.lights
    shown, used = dict[Name, TrafficLight](), set[int]()
    for name, numbers in governing.items():
        turn = inside.setdefault(name) or lanelets[name].turn
        turn = TurnType.LEFT if turn is TurnType.U_TURN else turn
        holding = sorted(number for number in numbers if turn in lights.get(number, _DARK)[1])
        used.update(holding)
        if holding:
            # One that shines goes before a dark one, one for this way alone before one for all.
            colours = [lights.get(number, _DARK) for number in holding]
            shown[name] = min(colours, key=lambda light: (light[0] is _DARK[0], len(light[1])))[0]
    idle, lost = len(lights.keys() - used), len(used - lights.keys())
    doubts.assume("A traffic light governs no lane that cars drive on", idle)
    doubts.assume("A light that is named and not there is of unknown state", lost)
    return shown


# Lanelets


def _references(parent: Element, path: str, doubts: Doubts) -> tuple[int, ...]:
    rows = ((part.get("ref", ""), f"{parent.tag}.{path}") for part in parent.findall(path))
    return tuple(doubts.read_all("references", foreign.read_whole, rows))


def _lanelet(
    element: Element, place: str, doubts: Doubts, limits: Mapping[int, float | None]
) -> Lanelet:
    left, right = element.find("leftBound"), element.find("rightBound")
    if left is None or right is None:
        raise fault_at(place, "needs a leftBound and a rightBound")
    edges = read_points(left, place), read_points(right, place)
    own = ((limit.text or "", place) for limit in element.findall("speedLimit"))
    speed_limits = doubts.read_all("speed limits", foreign.read_speed, own)
    signs = _references(element, "trafficSignRef", doubts)
    doubts.assume("A sign that is named is not there", len({*signs} - limits.keys()))
    speed_limits += [limit for sign in signs if (limit := limits.get(sign)) is not None]
    kinds = {(kind.text or "").strip() for kind in element.findall("laneletType")}
    doubts.doubt_unknown("types of lanelets", _TYPES, sorted(kinds), place)
    users = [(user.tag, (user.text or "").strip()) for user in element if user.tag[:4] == "user"]
    doubts.doubt_unknown("users of lanelets", _USERS, [user for _, user in users], place)
    if all(_USERS.get(user) for _, user in users):
        kinds |= {_USERS[user] for _, user in users}
    is_both = any(_USERS.get(user) == "" and tag != "userOneWay" for tag, user in users)
    doubts.assume("A lanelet that cars use both ways is one of its own direction", is_both)
    beside = (*element.findall("adjacentLeft"), *element.findall("adjacentRight"))
    ways = [lanelet.get("drivingDir") for lanelet in beside]
    doubts.doubt_unknown("neighbours of lanelets", _WAYS, ways, place)
    # The format pairs the points of the bounds; the middle of each pair is on the centreline.
    is_paired = len(edges[0]) == len(edges[1])
    segment = Segment(
        name=foreign.read_whole(element.get("id"), place),
        centerline=(edges[0] + edges[1]) / 2.0 if is_paired else None,
        left=edges[0],
        right=edges[1],
        successors=_references(element, "successor", doubts),
        predecessors=_references(element, "predecessor", doubts),
        left_neighbors=_references(element, "adjacentLeft[@drivingDir='same']", doubts),
        right_neighbors=_references(element, "adjacentRight[@drivingDir='same']", doubts),
        speed_limit_mps=min(speed_limits, default=None),
    )
    with refuse_shape(place):
        turn = classify_turn(segment_centreline(segment))
    paths = "trafficLightRef", "stopLine/trafficLightRef"
    lights = [number for path in paths for number in _references(element, path, doubts)]
    # One whose number can't be read is dark, and not none.
    lights += [-1] * (
        len([light for path in paths for light in element.findall(path)]) > len(lights)
    )
    outline = np.vstack([edges[0], edges[1][::-1]])
    return Lanelet(segment=segment, turn=turn, kinds=kinds, lights={*lights}, outline=outline)


def _find_inside(
    root: Element, lanelets: Mapping[Name, Segment], doubts: Doubts
) -> dict[Name, TurnType | None]:
    """Return the connectors named by intersections, with the turn if they have one."""
    following, named = find_successors(lanelets), dict[Name, TurnType | None]()
    for incoming in root.findall("intersection/incoming"):
        for lane in _references(incoming, "incomingLanelet", doubts):
            named |= {after: named.get(after) for after in following.get(lane, [])}
        for word, turn in _TURNS.items():
            for begin in ("successors", "outgoing"):
                named |= dict.fromkeys(_references(incoming, f"{begin}{word}", doubts), turn)
    bare = [
        intersection.find("incoming/incomingLanelet") is None
        for intersection in root.findall("intersection")
    ]
    doubts.assume("An intersection without incoming lanelets tells nothing", sum(bare))
    return {name: turn for name, turn in named.items() if name in lanelets}
