"""Roads of an OpenDRIVE file with their lanes, read as far as they are asked for.

Stations s run along a road's reference line, t to its left. Lanes count from the reference line:
positive ids to the left of it, negative ones to the right. N stations.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.documents import read_xml
from augment.formats.opendrive.geometry import LONGEST_M, PiecewiseCubic, ReferenceLine, read_float
from augment.geometry.frames import Pose, wrap

MOST_SECTIONS = 5_000
"""Lane sections of one road."""
DRIVEN = (
    *("driving", "bidirectional", "bus", "taxi", "HOV", "entry", "exit", "offRamp", "onRamp"),
    *("connectingRamp", "slipLane", "mwyEntry", "mwyExit"),
)
LIGHT_TYPES = ("1000001", "1000009", "1000010", "1000011", "1000012", "1000016")
"""Signals that are lights for cars."""
UNLIMITED = (None, "no limit", "undefined")
LIMIT_CHANGES = "A limit that begins in a section was left out"
START, END = "predecessor", "successor"
"""The ends of a road or lane, as links call them."""
CONTACTS = {"start": START, "end": END}
_RULES = {"RHT": False, "LHT": True}
_LAYER = "permanent"
"""The only one before OpenDRIVE 1.9, where links name one as well."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadLane:
    """A lane in one section of a road.

    Attributes:
        widths: Of the way since the section's start.
        is_border: Whether these are the lane's outer edge instead.
        links: Ids of the lanes that it is joined to, by its ends.
        speed_limit_mps: Its own, None for the road's.
    """

    kind: str
    widths: PiecewiseCubic
    is_border: bool
    links: Mapping[str, tuple[int, ...]]
    speed_limit_mps: float | None

    @property
    def is_driven(self) -> bool:
        """True if cars drive on it."""
        return self.kind in DRIVEN


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Section:
    """A part of a road with the same lanes, by their ids, all along."""

    start_m: float
    end_m: float
    lanes: Mapping[int, RoadLane]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapRoad:
    """One road.

    Attributes:
        junction: Of a connecting road, None for others.
        is_left_hand: Whether people drive on the left of it.
        links: Id and end of the road that is joined to it, by its ends; junctions have their own.
        limits: Pairs of station and speed in m/s that holds from there on, None for no limit.
        element: Where signals and objects stand.
    """

    id: str
    junction: str | None
    is_left_hand: bool
    links: Mapping[str, tuple[str, str]]
    line: ReferenceLine
    lane_offset: PiecewiseCubic
    sections: tuple[Section, ...]
    limits: tuple[tuple[float, float | None], ...]
    element: Element

    def is_forward(self, lane_id: int) -> bool:
        """Return whether people drive along s on a lane."""
        return (lane_id < 0) != self.is_left_hand

    def section_at(self, s_m: float) -> int:
        """Return the number of the section that a station lies in."""
        starts = [section.start_m for section in self.sections]
        return max(int(np.searchsorted(starts, s_m + 1e-9, side="right")) - 1, 0)

    def places_at(self, s_m: FloatArray, t_m: FloatArray) -> FloatArray:
        """Return x, y, heading of s (N, 3) so far to the left of stations."""
        poses = self.line.poses_at(s_m)
        poses[:, 0] -= t_m * np.sin(poses[:, 2])
        poses[:, 1] += t_m * np.cos(poses[:, 2])
        return poses

    def edges_at(self, section: Section, s_m: FloatArray) -> dict[int, tuple[FloatArray, ...]]:
        """Return t of the right and the left edge (N,) of a section's lanes, by their ids."""
        middle_m, edges = self.lane_offset.values_at(s_m), dict[int, tuple[FloatArray, ...]]()
        for side in (1, -1):
            inner_m = middle_m
            for number in sorted((n for n in section.lanes if n * side > 0), key=abs):
                lane = section.lanes[number]
                value_m = lane.widths.values_at(s_m - section.start_m)
                outer_m = inner_m + side * np.maximum(value_m, 0.0)
                outer_m = middle_m + value_m if lane.is_border else outer_m
                edges[number] = (inner_m, outer_m)[::side]
                inner_m = outer_m
        return edges

    def lane_pose(self, lane_id: int, s_m: float, offset_m: float = 0.0) -> Pose:
        """Return the pose in a lane's middle, or so far left of it, in its direction of travel.

        Raises:
            InvalidDocument: There is no such lane there, or the road is shorter.
        """
        place, at = f"road {self.id}", np.array([s_m])
        foreign.read_number(s_m, f"{place}.s", -0.01, self.line.length_m + 0.01)
        edges = self.edges_at(self.sections[self.section_at(s_m)], at)
        right_m, left_m = foreign.look_up(edges, lane_id, f"{place}.lane")
        return self.pose_at(s_m, float((right_m + left_m)[0]) / 2.0 + offset_m, lane_id)

    def pose_at(self, s_m: float, t_m: float, lane_id: int | None = None) -> Pose:
        """Return the pose at a place, along the road or in the direction of travel of a lane."""
        x_m, y_m, heading_rad = self.places_at(np.array([s_m]), np.array([t_m]))[0].tolist()
        turn_rad = 0.0 if lane_id is None or self.is_forward(lane_id) else np.pi
        return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(heading_rad + turn_rad))

    def limit_at(self, s_m: float) -> float | None:
        """Return the road's speed limit at a station, None where there is none."""
        return next((limit for since_m, limit in self.limits[::-1] if since_m <= s_m + 1e-6), None)


class RoadNetwork:
    """The roads of a file, each read once it is asked for.

    Attributes:
        elements: Roads as the file has them, by id.
        doubts: About what of them was not understood.
    """

    def __init__(self, path: Path) -> None:
        self.root = read_xml(path, what=foreign.WHAT)
        if self.root.tag != "OpenDRIVE":
            raise fault_at(path.name, f"is {self.root.tag[:40]!r}, not OpenDRIVE")
        header = self.root.find("header")
        version = "" if header is None else f"{header.get('revMajor')}.{header.get('revMinor')}"
        if not version.startswith("1."):
            raise fault_at(f"{path.name}: header", f"version {version[:20]!r} is not read; 1.x is")
        self.doubts, self._roads = Doubts(), dict[str, MapRoad]()
        offset = self.root.find("header/offset")
        if offset is not None and any(value.strip("0.+-eE") for value in offset.attrib.values()):
            self.doubts.assume("The header's offset was left out: places are the file's own")
        roads = [(element.get("id", ""), element) for element in self.root.findall("road")]
        self.elements = self.doubts.index_last("roads", roads)
        if not self.elements:
            raise fault_at(path.name, "holds no road")

    def road(self, road_id: str, place: str = "road") -> MapRoad:
        """Return a road.

        Raises:
            InvalidDocument: There is none of that id, or it can't be read.
        """
        if road_id not in self._roads:
            element = foreign.look_up(self.elements, road_id, place)
            self._roads[road_id] = _read_road(element, self.doubts)
        return self._roads[road_id]

    def roads_near(self, x_m: float, y_m: float, reach_m: float) -> list[MapRoad]:
        """Return the roads that can be within reach of a place; unreadable ones are doubts."""
        x, y, length_m, number = self._extents.T
        near = ~(np.hypot(x - x_m, y - y_m) > length_m + reach_m)
        names = list(self.elements)
        rows = ((names[int(row)],) for row in np.unique(number[near]))
        return self.doubts.read_all("roads", self.road, rows)

    def list_exits(self, road: MapRoad, end: str) -> list[tuple[str, str]]:
        """Return the roads past an end of a road, with the ends at which they are entered."""
        if end in road.links:
            return [road.links[end]]
        link = road.element.find(f"link/{end}")
        number = None if link is None else link.get("elementId")
        return [
            (
                connection.get("connectingRoad", connection.get("linkedRoad", "")),
                CONTACTS.get(connection.get("contactPoint", ""), START),
            )
            for junction in self.root.findall("junction")
            for connection in junction.findall("connection")
            if junction.get("id") == number and connection.get("incomingRoad") == road.id
        ]

    @cached_property
    def lights(self) -> frozenset[str]:
        """Ids of the signals that are lights for cars."""
        signals = self.root.iterfind("road/signals/signal")
        return frozenset(s.get("id", "") for s in signals if s.get("type") in LIGHT_TYPES)

    @cached_property
    def _extents(self) -> FloatArray:
        """Start, length and number of the road of each piece; NaN where it can't be read."""
        rows = []
        for number, element in enumerate(self.elements.values()):
            for piece in element.findall("planView/geometry"):
                row = [np.nan] * 3
                with suppress(ValueError):
                    row = [float(piece.get(name, "nan")) for name in ("x", "y", "length")]
                rows.append([*row, number])
        # Lanes lie beside the line.
        return np.asarray(np.array(rows).reshape(-1, 4) + np.array([0.0, 0.0, 50.0, 0.0]))


# Private


def _read_road(element: Element, doubts: Doubts) -> MapRoad:
    road_id = element.get("id", "")
    place = f"road {road_id[:20]}"
    line = ReferenceLine(element.find("planView"), place)
    layers = [e for e in element.findall("lanes") if e.get("layer", _LAYER) == _LAYER]
    text = "Lanes of a layer that is not permanent were left out"
    doubts.assume(text, len(element.findall("lanes")) - len(layers))
    sections = [section for lanes in layers for section in lanes.findall("laneSection")]
    if not 1 <= len(sections) <= MOST_SECTIONS:
        text = f"has {len(sections)} lane sections; 1 to {MOST_SECTIONS} are read"
        raise fault_at(place, text)
    starts = [read_float(section, "s", place, 0.0, LONGEST_M) for section in sections]
    halves = sum(section.get("singleSide") in ("true", "1") for section in sections)
    doubts.assume("A lane section of one side ended the lanes of the other", halves)
    ends = [*starts[1:], line.length_m]
    if sorted(starts) != starts:
        raise fault_at(f"{place}.laneSection", "lane sections need starts that ascend")
    limits = []
    for kind in element.findall("type"):
        limit = _read_limit(kind.find("speed"), place, doubts)
        limits.append((read_float(kind, "s", place), limit))
    doubts.assume(LIMIT_CHANGES, len({s_m for s_m, _ in limits if s_m > 0.01}.difference(starts)))
    slopes = [
        row.get(name, "0")
        for path, names in (("elevationProfile/*", "bcd"), ("lateralProfile/*", "abcd"))
        for row in element.findall(path)
        for name in names
    ]
    is_flat = all(text.strip("+-0.eE") == "" for text in slopes)
    doubts.assume("A road's slopes and superelevation were left out: scenes are flat", not is_flat)
    junction = element.get("junction", "-1")
    return MapRoad(
        id=road_id,
        junction=None if junction == "-1" else junction,
        is_left_hand=foreign.look_up(_RULES, element.get("rule", "RHT"), f"{place}.rule"),
        links=_read_links(element, place, doubts),
        line=line,
        lane_offset=PiecewiseCubic.read(
            (row for lanes in layers for row in lanes.findall("laneOffset")),
            *("s", f"{place}.laneOffset"),
        ),
        sections=tuple(
            Section(start_m=start_m, end_m=end_m, lanes=_read_lanes(section, place, doubts))
            for section, start_m, end_m in zip(sections, starts, ends, strict=True)
        ),
        limits=tuple(sorted(limits, key=lambda row: row[0])),
        element=element,
    )


def _read_links(element: Element, place: str, doubts: Doubts) -> dict[str, tuple[str, str]]:
    """Return the road at either end and the end at which it is entered, as far as said."""
    links = {}
    for end in (START, END):
        for link in element.findall(f"link/{end}"):
            with doubts.about("links of roads"):
                kinds = {"road": True, "junction": False}
                if foreign.look_up(kinds, link.get("elementType", ""), f"{place}.elementType"):
                    contact = link.get("contactPoint", "")
                    entered = foreign.look_up(CONTACTS, contact, f"{place}.contactPoint")
                    links[end] = link.get("elementId", ""), entered
    return links


def _read_lanes(section: Element, road: str, doubts: Doubts) -> dict[int, RoadLane]:
    lanes = []
    for side, least, most in (("left", 1, 1_000), ("right", -1_000, -1)):
        for element in section.findall(f"{side}/lane"):
            number = foreign.read_whole(element.get("id"), f"{road}.{side}.lane", least, most)
            place = f"{road}.lane {number}"
            widths, speeds = element.findall("width"), element.findall("speed")
            changes = [s for s in speeds if read_float(s, "sOffset", place, default=0.0) > 0.0]
            doubts.assume(LIMIT_CHANGES, len(changes))
            is_odd = element.get("direction", "standard") != "standard"
            doubts.assume("A lane's direction was left out: it is that of its side", is_odd)
            lane = RoadLane(
                kind=element.get("type", "none"),
                widths=PiecewiseCubic.read(widths or element.findall("border"), "sOffset", place),
                is_border=not widths and element.find("border") is not None,
                links={
                    end: tuple(
                        foreign.read_whole(link.get("id"), f"{place}.link")
                        for link in element.findall(f"link/{end}")
                        if link.get("layer", _LAYER) == _LAYER
                    )
                    for end in (START, END)
                },
                speed_limit_mps=_read_limit(speeds[0] if speeds else None, place, doubts),
            )
            lanes.append((number, lane))
    return doubts.index_last("lanes", lanes)


def _read_limit(speed: Element | None, place: str, doubts: Doubts) -> float | None:
    if speed is None or speed.get("max") in UNLIMITED:
        return None
    text = f"{speed.get('max')} {speed.get('unit', 'm/s')}"
    return doubts.read("speed limits", foreign.read_speed, text, f"{place}.speed")
