"""OpenDRIVE maps made by scenariogeneration or by hand, and where their lanes lie by sums.

The evaluation shares no code with the reader: it goes along every line in steps of two
centimetres, and takes widths as the polynomials that the file writes down.
"""

import math
import random
import warnings
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray
from scenariogeneration import xodr

FloatArray = NDArray[np.float64]


def make_map(seed: int) -> ET.Element:
    """A map of one of five kinds: curved roads with lanes that come and go, or junctions."""
    rng = random.Random(seed)
    drive = xodr.OpenDrive(f"map {seed}", revMinor=str(4 + seed % 5))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # lanes that come and go are linked once more
        (_add_road, _add_road, _add_road, _add_junction, _add_exit)[seed % 5](drive, rng)
        drive.adjust_roads_and_lanes()
    root: ET.Element = drive.get_element()
    return root


def _add_road(drive: xodr.OpenDrive, rng: random.Random) -> None:
    kind = rng.randrange(3)
    road = xodr.create_road(_curve(rng, kind), 1, _lanes(rng, 1), _lanes(rng, -1), lane_width=3.2)
    drive.add_road(road)
    if kind == 1:
        road.lanes.add_laneoffset(xodr.LaneOffset(0.0, 0.0, 0.0, 0.001, -0.00001))
        return
    ends = road_lanes(road, 1), road_lanes(road, -1)
    second = xodr.create_road(xodr.Line(40.0), 2, *ends, lane_width=3.2)
    road.add_successor(xodr.ElementType.road, 2, xodr.ContactPoint.start)
    second.add_predecessor(xodr.ElementType.road, 1, xodr.ContactPoint.end)
    drive.add_road(second)


def road_lanes(road: xodr.Road, side: int) -> int:
    """How many lanes a road ends with on a side."""
    section = road.lanes.lanesections[-1]
    return len(section.leftlanes if side > 0 else section.rightlanes)


def _curve(rng: random.Random, kind: int) -> list[object]:
    bend = rng.choice((-1.0, 1.0)) * rng.uniform(0.005, 0.04)
    if kind == 0:
        spiral, back = xodr.Spiral(0.0, bend, 40.0), xodr.Spiral(bend, -bend / 2.0, 35.0)
        return [xodr.Line(25.0), spiral, xodr.Arc(bend, 30.0), back]
    if kind == 1:
        return [xodr.ParamPoly3(0, 60, rng.uniform(-4, 4), -3, 0, 0, rng.uniform(5, 25), -10)]
    u, v = (0, 1.0, 0, -0.00002), (0, 0, rng.uniform(0.002, 0.008), -0.00003)
    return [xodr.Arc(bend, 50.0), xodr.ParamPoly3(*u, *v, prange="arcLength", length=50.0)]


def _lanes(rng: random.Random, side: int) -> list[xodr.LaneDef]:
    few = rng.randint(1, 2)
    outer = side * (few + 1)
    return [
        xodr.LaneDef(10.0, 30.0, few, few + 1, outer),
        xodr.LaneDef(34.0, 44.0, few + 1, few, outer),
    ]


def _add_junction(drive: xodr.OpenDrive, rng: random.Random) -> None:
    arms = rng.randint(3, 4)
    roads = [xodr.create_road(xodr.Line(rng.uniform(30, 90)), n, 1, 1) for n in range(arms)]
    creator = xodr.CommonJunctionCreator(100, "crossing")
    for number, road in enumerate(roads):
        angle = number * 2.0 * math.pi / arms + rng.uniform(-0.2, 0.2)
        end = "successor" if number == 0 else "predecessor"
        creator.add_incoming_road_circular_geometry(road, 22.0, angle, end)
        drive.add_road(road)
    for first in range(arms):
        for second in range(first):
            creator.add_connection(second, first)
    drive.add_junction_creator(creator)


def _add_exit(drive: xodr.OpenDrive, rng: random.Random) -> None:
    """A motorway that forks without connecting roads."""
    wide, on = (
        xodr.create_road(xodr.Line(80.0), 1, 0, 3),
        xodr.create_road(xodr.Line(rng.uniform(40.0, 70.0)), 2, 0, 2),
    )
    off = xodr.create_road([xodr.Spiral(-0.001, -0.02, 50.0)], 3, 0, 1)
    creator = xodr.DirectJunctionCreator(100, "exit")
    wide.add_successor(xodr.ElementType.junction, 100)
    for road in (on, off):
        road.add_predecessor(xodr.ElementType.junction, 100)
    creator.add_connection(wide, on, [-1, -2], [-1, -2])
    creator.add_connection(wide, off, -3, -1)
    for road in (wide, on, off):
        drive.add_road(road)
    drive.add_junction_creator(creator)


def write(root: ET.Element, file: Path) -> Path:
    file.write_bytes(ET.tostring(root))
    return file


# The independent evaluation


def lane_lines(root: ET.Element) -> dict[str, FloatArray]:
    """The middles (N, 2) of all lanes that are driven on, along s, by "road,lane,section"."""
    lines = {}
    for road in root.findall("road"):
        stations, poses = _reference_line(road)
        sections = road.findall("lanes/laneSection")
        starts = [float(one.get("s", 0)) for one in sections] + [stations[-1]]
        offset = _value(road.findall("lanes/laneOffset"), "s", stations)
        for number, section in enumerate(sections):
            rows = (stations >= starts[number]) & (stations <= starts[number + 1])
            for sign, side in ((1, "left"), (-1, "right")):
                edge = offset[rows]
                lanes = section.findall(f"{side}/lane")
                for lane in sorted(lanes, key=lambda one: abs(int(one.get("id", 0)))):
                    since = stations[rows] - starts[number]
                    width = _value(lane.findall("width"), "sOffset", since)
                    t, edge = edge + sign * width / 2.0, edge + sign * width
                    x, y, heading = poses[rows].T
                    place = np.column_stack([x - t * np.sin(heading), y + t * np.cos(heading)])
                    if lane.get("type") == "driving" and np.ptp(since) > 0.01:
                        lines[f"{road.get('id')},{lane.get('id')},{number}"] = place
    return lines


def _value(elements: list[ET.Element], at: str, stations: FloatArray) -> FloatArray:
    value = np.zeros(len(stations))
    for element in elements:
        since = stations - float(element.get(at, 0))
        cubic = sum(
            float(element.get(name, 0)) * since**power for power, name in enumerate("abcd")
        )
        value = np.where(since >= -1e-9, cubic, value)
    return value


def _reference_line(road: ET.Element) -> tuple[FloatArray, FloatArray]:
    """Stations (N,) and x, y, heading (N, 3), by sums over short steps."""
    stations, poses = [], []
    for piece in road.findall("planView/geometry"):
        s, x, y, heading, length = (
            float(piece.get(n, 0)) for n in ("s", "x", "y", "hdg", "length")
        )
        shape, steps = piece[0], max(int(length / 0.02), 2)
        number = {name: float(value) for name, value in shape.attrib.items() if name != "pRange"}
        along = np.linspace(0.0, length, steps + 1)
        if shape.tag == "paramPoly3":
            full = 1.0 if shape.get("pRange") == "normalized" else length
            p = np.linspace(0.0, full, steps + 1)
            u, v = (
                sum(number[f"{n}{axis}"] * p**k for k, n in enumerate("abcd")) for axis in "UV"
            )
            chords = np.hypot(np.diff(u), np.diff(v))
            arc = np.concatenate([[0.0], np.cumsum(chords)])
            along = arc * length / arc[-1]
            turn = np.arctan2(np.gradient(v, p, edge_order=2), np.gradient(u, p, edge_order=2))
        else:
            first = number.get("curvature", number.get("curvStart", 0.0))
            last = number.get("curvature", number.get("curvEnd", 0.0))
            bend = np.linspace(first, last, steps + 1)
            turn = (
                np.concatenate([[0.0], np.cumsum((bend[1:] + bend[:-1]) / 2.0)]) * length / steps
            )
            middle = (turn[1:] + turn[:-1]) / 2.0
            u, v = (
                np.concatenate([[0.0], np.cumsum(part)]) * length / steps
                for part in (np.cos(middle), np.sin(middle))
            )
        cos, sin = math.cos(heading), math.sin(heading)
        stations.append(s + along)
        poses.append(
            np.column_stack([x + u * cos - v * sin, y + u * sin + v * cos, heading + turn])
        )
    return np.concatenate(stations), np.vstack(poses)


# By hand

ROAD = (
    '<road id="{id}" junction="{junction}" length="100" {more}>{link}{type}<planView>'
    '<geometry s="0" x="{x}" y="0" hdg="0" length="100">{shape}</geometry></planView>'
    "<lanes>{offset}{lanes}</lanes>{end}</road>"
)
LANES = (
    '<laneSection s="0"><left><lane id="1" type="driving">{width}</lane></left>'
    '<center><lane id="0"/></center><right><lane id="-1" type="driving">{width}</lane>{outer}'
    "</right></laneSection>"
)
WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'


def by_hand(**parts: str) -> str:
    """A map of one straight road of 100 m with a lane each way, but for some parts."""
    lanes = {"width": WIDTH, "outer": ""}
    lanes |= {name: parts.pop(name) for name in lanes if name in parts}
    road = dict.fromkeys(("more", "link", "type", "offset", "end"), "")
    road |= {"id": "1", "junction": "-1", "shape": "<line/>", "x": "0"}
    road |= {"lanes": LANES.format(**lanes)} | {n: parts[n] for n in parts if n != "rest"}
    head = f'<header revMajor="1" revMinor="7">{parts.pop("header", "")}</header>'
    return f"<OpenDRIVE>{head}{ROAD.format(**road)}{parts.get('rest', '')}</OpenDRIVE>"
