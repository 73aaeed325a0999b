"""The map around a place of an OpenDRIVE network, as segments and areas.

A lane in one section of a road is a segment; those of connecting roads lie in an intersection.
Joints are taken from the links of lanes and roads, and from the connections of junctions.
N stations.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
import shapely

from augment import foreign
from augment.formats.opendrive.geometry import read_float
from augment.formats.opendrive.network import CONTACTS, END, START, MapRoad, RoadNetwork, Section
from augment.formats.road_map import RoadMap, Segment
from augment.geometry.frames import Pose
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide

_STEP_M: Final = 0.4
_THIN_M: Final = 0.002
"""Lines are sampled this densely; of their points those stay that are so far off the others' line.
"""
_NARROWEST_M = 0.1
"""A lane that is nowhere wider is none."""
AREA_LANES = {
    "sidewalk": AreaKind.WALKWAY,
    "walking": AreaKind.WALKWAY,
    "shoulder": AreaKind.DRIVABLE,
    "stop": AreaKind.DRIVABLE,
    "parking": AreaKind.CARPARK,
}
AREA_OBJECTS = {"crosswalk": AreaKind.CROSSWALK, "parkingSpace": AreaKind.CARPARK}
_WAYS = {"+": (True,), "-": (False,), "none": (True, False)}
LaneKey = tuple[str, int, int]
"""Road, number of its section, id of the lane."""
Joint = tuple[tuple[LaneKey, str], tuple[LaneKey, str]]
"""Two lanes, each with its end."""
Areas = list[tuple[AreaKind, foreign.FloatArray]]


def map_around(
    network: RoadNetwork,
    ego: Pose,
    reach_m: float,
    lights: Mapping[str, TrafficLight] | None = None,
) -> RoadMap:
    """Return the map of the roads that can be within reach of the ego.

    Args:
        network: The whole of it.
        ego: In its frame.
        reach_m: How far the map goes.
        lights: States of signals by id; those of others are unknown.
    """
    roads = network.roads_near(ego.x_m, ego.y_m, reach_m)
    segments, areas, left_out = dict[LaneKey, Segment](), Areas(), Counter[str]()
    for road in roads:
        for number, section in enumerate(road.sections):
            areas += _lay_section(road, number, section, segments, left_out)
        for element in road.element.findall("objects/*"):
            kind = element.get("type") if element.tag == "object" else element.tag
            if kind in AREA_OBJECTS:
                areas += network.doubts.read("objects", _read_areas, road, element) or ()
                is_repeated = element.find("repeat") is not None
                network.doubts.assume("An object that is repeated was laid once", is_repeated)
            else:
                left_out[f"object {kind}"] += 1
    following = _join(network, {road.id: road for road in roads}, segments)
    governing = _find_lights(network, roads, segments, following, left_out)
    shown = {
        key: (lights or {}).get(name, TrafficLight.UNKNOWN) for key, name in governing.items()
    }
    other = TrafficLight.NONE if network.lights else TrafficLight.UNKNOWN
    laid = (
        replace(
            segment,
            successors=tuple(_name(after) for after in following[key]),
            light=shown.get(key, other),
        )
        for key, segment in segments.items()
    )
    is_left = any(road.is_left_hand for road in roads)
    return RoadMap(
        place="lane",
        segments=tuple(laid),
        areas=tuple(areas),
        side=TrafficSide.LEFT if is_left else TrafficSide.RIGHT,
        is_side_told=any("rule" in road.element.attrib for road in roads),
        left_out=left_out,
        doubts=network.doubts,
    )


# Private


def _name(key: LaneKey) -> str:
    road_id, number, lane_id = key
    return f"{road_id},{lane_id}" + (f" of section {number}" if number else "")


# Lanes and areas


def _lay_section(
    road: MapRoad,
    number: int,
    section: Section,
    segments: dict[LaneKey, Segment],
    left_out: Counter[str],
) -> Areas:
    """Add the segments of a section, and return its areas."""
    length_m, areas = section.end_m - section.start_m, Areas()
    if length_m < 1e-3:
        return areas
    grid_m = np.linspace(section.start_m, section.end_m, math.ceil(length_m / _STEP_M) + 1)
    # Kinks are among the stations.
    profiles = [lane.widths.starts_m + section.start_m for lane in section.lanes.values()]
    kinks_m = np.concatenate([road.line.starts_m, road.lane_offset.starts_m, *profiles])
    s_m = np.union1d(grid_m, kinks_m[(kinks_m > section.start_m) & (kinks_m < section.end_m)])
    for lane_id, (right_m, left_m) in road.edges_at(section, s_m).items():
        lane = section.lanes[lane_id]
        if (left_m - right_m).max() < _NARROWEST_M:
            continue
        middle_m = (left_m + right_m) / 2.0
        left, line, right = (
            _thin(road.places_at(s_m, t_m)[:, :2]) for t_m in (left_m, middle_m, right_m)
        )
        if lane.kind in AREA_LANES:
            areas.append((AREA_LANES[lane.kind], np.vstack([left, right[::-1]])))
        elif not lane.is_driven:
            left_out[f"lane {lane.kind[:20]}"] += 1
        else:
            is_forward = road.is_forward(lane_id)
            if not is_forward:
                left, line, right = right[::-1], line[::-1], left[::-1]
            beside = [
                (_name((road.id, number, other)),) * (other in section.lanes)
                for step in (1, -1)
                for other in (lane_id + step or step,)
            ][:: 1 if is_forward else -1]
            limit_mps = lane.speed_limit_mps or road.limit_at(section.start_m)
            segments[road.id, number, lane_id] = Segment(
                name=_name((road.id, number, lane_id)),
                crosses=road.junction is not None,
                centerline=line,
                left=left,
                right=right,
                left_neighbors=beside[0],
                right_neighbors=beside[1],
                speed_limit_mps=limit_mps,
            )
    return areas


def _thin(points: foreign.FloatArray) -> foreign.FloatArray:
    """Return the points (P, 2) that a line needs."""
    line = shapely.LineString(points).simplify(_THIN_M, preserve_topology=False)
    return np.asarray(shapely.get_coordinates(line))


def _read_areas(road: MapRoad, element: Element) -> Areas:
    """Return the outlines of an object in the map's frame; of one without, its box."""
    kind, place = AREA_OBJECTS[element.get("type", "")], f"road {road.id}"
    place += f".object {element.get('id', '')[:20]}"
    s_m, t_m = (read_float(element, name, place) for name in "st")
    pose = road.pose_at(s_m, t_m).turn(read_float(element, "hdg", place, default=0.0))
    areas = Areas()
    for outline in [*element.iter("outline")] or [element]:
        corners = [[read_float(c, n, place) for n in "st"] for c in outline.iter("cornerRoad")]
        local = [[read_float(c, n, place) for n in "uv"] for c in outline.iter("cornerLocal")]
        if corners:
            areas.append((kind, road.places_at(*np.array(corners).T)[:, :2]))
            continue
        if not local:
            u_m, v_m = (read_float(element, n, place, 0.0) / 2.0 for n in ("length", "width"))
            local = [[u_m, v_m], [-u_m, v_m], [-u_m, -v_m], [u_m, -v_m]]
        areas.append((kind, pose.to_parent(np.array(local))))
    return areas


# Joints


def _join(
    network: RoadNetwork, roads: Mapping[str, MapRoad], segments: Mapping[LaneKey, Segment]
) -> dict[LaneKey, list[LaneKey]]:
    """Return which segments follow each one."""
    following: dict[LaneKey, list[LaneKey]] = {key: [] for key in segments}
    for ends in chain(_list_links(roads, segments), _list_connections(network, roads)):
        if not all(key in segments for key, _ in ends):
            continue
        # People leave a lane at its end if they drive along s on it, else at its start.
        leaves, enters = ((end == END) == roads[k[0]].is_forward(k[2]) for k, end in ends)
        (before, _), (after, _) = ends if leaves else ends[::-1]
        if leaves != enters and after not in following[before]:
            following[before].append(after)
    return following


def _list_links(roads: Mapping[str, MapRoad], segments: Iterable[LaneKey]) -> Iterator[Joint]:
    """Yield the joints that lanes name, with the next section or the road that is joined."""
    for key in segments:
        road_id, number, lane_id = key
        road = roads[road_id]
        for end, step, opposite in ((START, -1, END), (END, 1, START)):
            for other in road.sections[number].lanes[lane_id].links[end]:
                if 0 <= number + step < len(road.sections):
                    yield (key, end), ((road_id, number + step, other), opposite)
                elif (joined := roads.get(road.links.get(end, ("", ""))[0])) is not None:
                    other_end = road.links[end][1]
                    yield (key, end), ((joined.id, _last(joined, other_end), other), other_end)


def _list_connections(network: RoadNetwork, roads: Mapping[str, MapRoad]) -> Iterator[Joint]:
    """Yield the joints that junctions name."""
    for junction in network.root.findall("junction"):
        is_virtual = junction.get("type") == "virtual"
        network.doubts.assume("The connections of a virtual junction were left out", is_virtual)
        for connection in [] if is_virtual else junction.findall("connection"):
            connecting = connection.get("connectingRoad", connection.get("linkedRoad", ""))
            inner, incoming = roads.get(connecting), roads.get(connection.get("incomingRoad", ""))
            if inner is None or incoming is None:
                continue
            place = f"junction {junction.get('id')}"
            contact = connection.get("contactPoint", "start")
            with network.doubts.about("connections of junctions"):
                end = foreign.look_up(CONTACTS, contact, f"{place}.contactPoint")
            if contact not in CONTACTS:
                continue
            outer_end = _nearest_end(incoming, inner, end)
            for link in connection.findall("laneLink"):
                with network.doubts.about("links of junctions"):
                    outer, onto = (foreign.read_whole(link.get(n), place) for n in ("from", "to"))
                    before = incoming.id, _last(incoming, outer_end), outer
                    yield (before, outer_end), ((inner.id, _last(inner, end), onto), end)


def _last(road: MapRoad, end: str) -> int:
    """The number of the section at an end of a road."""
    return 0 if end == START else len(road.sections) - 1


def _nearest_end(road: MapRoad, other: MapRoad, other_end: str) -> str:
    """The end of a road that lies at an end of another one."""
    ends = [of.line.poses_at(np.array([0.0, of.line.length_m]))[:, :2] for of in (road, other)]
    gaps_m = np.hypot(*(ends[0] - ends[1][0 if other_end == START else 1]).T)
    return START if gaps_m[0] < gaps_m[1] else END


# Lights


def _find_lights(
    network: RoadNetwork,
    roads: Sequence[MapRoad],
    segments: Mapping[LaneKey, Segment],
    following: Mapping[LaneKey, Sequence[LaneKey]],
    left_out: Counter[str],
) -> dict[LaneKey, str]:
    """Return the id of the light that governs each segment of an intersection that has one."""
    governing: dict[LaneKey, str] = {}
    lanes_of = defaultdict[str, list[LaneKey]](list)
    for key in segments:
        lanes_of[key[0]].append(key)
    placed = [(road, e) for road in roads for e in road.element.findall("signals/*")]
    for road, element in placed:
        if element.tag not in ("signal", "signalReference"):
            continue
        name = element.get("id", "")
        if name not in network.lights:
            is_signal = element.tag == "signal"
            left_out.update([f"signal {element.get('type', '')[:20]}"] * is_signal)
            continue
        with network.doubts.about("lights"):
            place = f"road {road.id}.{element.tag} {name[:20]}"
            ways = foreign.look_up(_WAYS, element.get("orientation", "none"), place)
            spans = [
                sorted(foreign.read_whole(v.get(n), place) for n in ("fromLane", "toLane"))
                for v in element.findall("validity")
            ]
            governed = []
            for key in lanes_of[road.id]:
                is_valid = not spans or any(low <= key[2] <= high for low, high in spans)
                if is_valid and road.is_forward(key[2]) in ways:
                    inner = [key] if segments[key].crosses else following[key]
                    governed += [after for after in inner if segments[after].crosses]
            governing |= dict.fromkeys(governed, name)
            network.doubts.assume("A light governs no way through a junction", not governed)
    return governing
