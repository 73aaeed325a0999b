"""Positions of OpenSCENARIO on an OpenDRIVE map, as poses in the map's frame.

Of the two points of a road user this is the point of reference, not the middle of its box. A
position relative to a lane or road has the heading of travel there, one relative to somebody has
theirs, where no orientation says otherwise. A route is the shortest way along roads through its
waypoints; it leaves the first as cars do on that lane. Source: ASAM OpenSCENARIO XML 1.3.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import count, pairwise
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import fault_at
from augment.formats.opendrive.geometry import read_float
from augment.formats.opendrive.network import END, START, MapRoad, RoadNetwork
from augment.geometry.frames import Pose, difference, wrap

_REACH_M: Final = 30.0
"""So far from a reference line a place can be on its road."""
_MOST_PARTS = 1_000
"""A way along roads that is longer is none."""
_STEP_M = 0.25
"""Lanes are measured by steps so long."""
_MOST_OPEN = 100
"""Positions relative to each other."""
_LONGEST_M = 20_000.0
"""No route is longer."""
Place = tuple[MapRoad, float, float, int]
"""Road, s and t there, and the id of the lane."""


class PositionReader:
    """Finds poses; those of entities by the actions that place them.

    Args:
        network: The map.
        positions: The element that places each entity at t0, by its name.
    """

    def __init__(self, network: RoadNetwork, positions: Mapping[str, Element]) -> None:
        self._network, self._positions = network, positions
        self._poses, self._open, self.actor = dict[str, Pose](), set[str](), ""

    def at(self, poses: Mapping[str, Pose], actor: str) -> "PositionReader":
        """Return a reader for what somebody does, for whom entities are elsewhere."""
        later = PositionReader(self._network, self._positions)
        later.actor = actor
        later._poses |= poses
        return later

    def entity_pose(self, name: str) -> Pose:
        """Return where an entity is at t0.

        Raises:
            InvalidDocument: Nobody placed it, or positions refer to each other in a circle.
        """
        if name in self._open or len(self._open) > _MOST_OPEN:
            text = f"refers to itself in a circle, or over {_MOST_OPEN} others"
            raise fault_at(f"entity {name[:40]}", f"its position {text}")
        if name not in self._poses:
            position = foreign.look_up(self._positions, name, "position of an entity at t0")
            self._open.add(name)
            try:
                self._poses[name] = self.find_pose(position, f"entity {name[:40]}")
            finally:
                self._open.discard(name)
        return self._poses[name]

    def find_pose(self, position: Element, place: str) -> Pose:
        """Return the pose that a Position says.

        Raises:
            InvalidDocument: It is of another kind, or leads off the map.
        """
        element = next(iter(position), Element("nothing"))
        finders: dict[str, Callable[[Element, str], Pose]] = {
            "WorldPosition": self._find_world,
            "LanePosition": self._find_lane,
            "RoadPosition": self._find_road,
            "RelativeLanePosition": self._find_relative_lane,
            "RelativeRoadPosition": self._find_relative_road,
            "RelativeObjectPosition": self._find_beside,
            "RelativeWorldPosition": self._find_beside,
            "RoutePosition": self._find_on_route,
        }
        find = foreign.look_up(finders, element.tag, place)
        place = f"{place}.{element.tag}"
        pose, orientation = find(element, place), element.find("Orientation")
        if orientation is None:
            return pose
        turn_rad = _number(orientation, "h")
        if orientation.get("type", "absolute") == "relative":
            return pose.turn(turn_rad)
        return replace(pose, heading_rad=wrap(turn_rad))

    def locate(self, pose: Pose, place: str) -> Place:
        """Return where on which road a pose is, of several the best aligned lane.

        Raises:
            InvalidDocument: It is on no lane.
        """
        best: list[tuple[float, int, Place]] = []
        for number, road in enumerate(self._network.roads_near(pose.x_m, pose.y_m, _REACH_M)):
            s_m, t_m = _project(road, pose)
            section = road.sections[road.section_at(s_m)]
            for lane_id, (right_m, left_m) in road.edges_at(section, np.array([s_m])).items():
                if right_m[0] - 0.01 <= t_m <= left_m[0] + 0.01:
                    heading_rad = road.pose_at(s_m, t_m, lane_id).heading_rad
                    turn_rad = abs(difference(heading_rad, pose.heading_rad))
                    best.append((round(turn_rad, 3), number, (road, s_m, t_m, lane_id)))
        if not best:
            raise fault_at(place, "who it is relative to is on no lane")
        return min(best, key=lambda row: row[:2])[2]

    def _find_world(self, element: Element, place: str) -> Pose:
        x_m, y_m = (read_float(element, name, place) for name in "xy")
        return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(_number(element, "h")))

    def _find_lane(self, element: Element, place: str) -> Pose:
        road = self._network.road(element.get("roadId", ""), f"{place}.roadId")
        lane_id = foreign.read_whole(element.get("laneId"), f"{place}.laneId")
        return road.lane_pose(lane_id, read_float(element, "s", place), _number(element, "offset"))

    def _find_road(self, element: Element, place: str) -> Pose:
        road = self._network.road(element.get("roadId", ""), f"{place}.roadId")
        s_m = read_float(element, "s", place, 0.0, road.line.length_m + 0.01)
        return road.pose_at(s_m, read_float(element, "t", place))

    def _find_on_route(self, element: Element, place: str) -> Pose:
        inside = next(element.iterfind("InRoutePosition/*"), Element("nothing"))
        if inside.tag == "FromCurrentEntity":
            return self.entity_pose(inside.get("entityRef", ""))
        names = {"FromLaneCoordinates": "laneId", "FromRoadCoordinates": "t"}
        name = foreign.look_up(names, inside.tag, place)
        places = self.find_waypoints(element, place)
        s_name = "s" if "pathS" not in inside.attrib else "pathS"
        way_m = read_float(inside, s_name, place, 0.0)
        road, s_m, is_along = walk_legs(find_legs(self._network, places, place), way_m, place)
        if name == "laneId":
            lane_id = foreign.read_whole(inside.get(name), f"{place}.{name}")
            return road.lane_pose(lane_id, s_m, _number(inside, "laneOffset"))
        pose = road.pose_at(s_m, read_float(inside, name, place))
        return pose if is_along else pose.turn(math.pi)

    def find_waypoints(self, holder: Element, place: str) -> list[Place]:
        """Return where the waypoints of a route lie."""
        positions = holder.findall(".//Waypoint/Position")
        if len(positions) < 2:
            raise fault_at(place, "needs a Route of two waypoints at least")
        return [self._find_waypoint(position, place) for position in positions]

    def _find_waypoint(self, position: Element, place: str) -> Place:
        element = position.find("LanePosition")
        if element is None:
            return self.locate(self.find_pose(position, place), place)
        # Where roads meet, a pose is on several of them.
        lane_id = foreign.read_whole(element.get("laneId"), f"{place}.laneId")
        road = self._network.road(element.get("roadId", ""), f"{place}.roadId")
        return road, read_float(element, "s", place), 0.0, lane_id

    def _find_relative_lane(self, element: Element, place: str) -> Pose:
        pose = self.entity_pose(element.get("entityRef", ""))
        start = road, s_m, _, lane_id = self.locate(pose, place)
        by_lane, step = "dsLane" in element.attrib, foreign.read_whole(element.get("dLane"), place)
        along_m = _number(element, "dsLane" if by_lane else "ds")
        along_m *= 1 if road.is_forward(lane_id) or not by_lane else -1
        away_rad = difference(pose.heading_rad, road.pose_at(s_m, 0.0, lane_id).heading_rad)
        road, s_m, lane_id, turns = self._advance(start, along_m, place, by_lane=by_lane)
        pose = road.lane_pose(step_lanes(lane_id, turns * step), s_m, _number(element, "offset"))
        # Beside who drives against the lane one does too.
        return pose if abs(away_rad) <= math.pi / 2.0 else pose.turn(math.pi)

    def _find_relative_road(self, element: Element, place: str) -> Pose:
        pose = self.entity_pose(element.get("entityRef", ""))
        road, s_m, t_m, lane_id = self.locate(pose, place)
        is_forward, along_m = road.is_forward(lane_id), _number(element, "ds")
        road, s_m, _, turns = self._advance((road, s_m, t_m, 0), along_m, place)
        pose = road.pose_at(s_m, turns * (t_m + _number(element, "dt")))
        return pose if is_forward == (turns > 0) else pose.turn(math.pi)

    def _find_beside(self, element: Element, place: str) -> Pose:
        pose = self.entity_pose(element.get("entityRef", ""))
        axes = replace(pose, heading_rad=0.0) if element.tag == "RelativeWorldPosition" else pose
        away = np.array([[_number(element, "dx"), _number(element, "dy")]])
        x_m, y_m = axes.to_parent(away)[0].tolist()
        return replace(pose, x_m=x_m, y_m=y_m)

    def _advance(
        self, start: Place, along_m: float, place: str, *, by_lane: bool = False
    ) -> tuple[MapRoad, float, int, int]:
        """Return road, station and lane so far along s, and -1 where s runs the other way.

        It leads over no junction. The lane 0 is the road's own line. By lane the way is that
        of the lane's middle.
        """
        (road, s_m, _, lane_id), turns = start, 1
        number, is_ahead, left_m = road.section_at(s_m), along_m >= 0.0, abs(along_m)
        for _ in range(_MOST_PARTS):
            section, end = road.sections[number], END if is_ahead else START
            until_m = section.end_m if is_ahead else section.start_m
            stations_m, ways_m = np.array([s_m, until_m]), np.array([0.0, abs(until_m - s_m)])
            if by_lane:
                stations_m = np.linspace(s_m, until_m, math.ceil(ways_m[1] / _STEP_M) + 1)
                edges = road.edges_at(section, stations_m)
                right_m, left_edge_m = foreign.look_up(edges, lane_id, place)
                middles = road.places_at(stations_m, (right_m + left_edge_m) / 2.0)[:, :2]
                ways_m = np.cumsum(np.hypot(*np.diff(middles, axis=0, prepend=middles[:1]).T))
            if left_m <= ways_m[-1] + 0.01:
                return road, float(np.interp(left_m, ways_m, stations_m)), lane_id, turns
            left_m, number = left_m - ways_m[-1], number + (1 if is_ahead else -1)
            is_inside = 0 <= number < len(road.sections)
            lane_ids = (
                foreign.look_up(section.lanes, lane_id, place).links[end] if lane_id else [0]
            )
            if not lane_ids or not (is_inside or end in road.links):
                raise fault_at(place, f"leads {left_m:.1f} m past an end on road {road.id[:20]}")
            s_m, lane_id = until_m, lane_ids[0]
            if not is_inside:
                name, met = road.links[end]
                road, is_ahead = self._network.road(name, place), met == START
                turns *= -1 if met == end else 1
                s_m, number = (0.0, 0) if is_ahead else (road.line.length_m, -1)
                number %= len(road.sections)
        raise fault_at(place, f"leads over more than {_MOST_PARTS} parts of roads")


def step_lanes(lane_id: int, step: int) -> int:
    """Return the id so many lanes to the left along s; no lane has 0, so it is no step."""
    other = lane_id + step
    is_across = other == 0 or (other > 0) != (lane_id > 0)
    return other + is_across * (1 if step > 0 else -1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A part of a route along one road, from a station to another."""

    road: MapRoad
    from_m: float
    to_m: float


def find_legs(network: RoadNetwork, places: Sequence[Place], place: str) -> list[Leg]:
    """Return the legs of the shortest way through places.

    Raises:
        InvalidDocument: No road leads from one to the next.
    """
    return [leg for ends in pairwise(places) for leg in _connect(network, *ends, place)]


def walk_legs(legs: Sequence[Leg], way_m: float, place: str) -> tuple[MapRoad, float, bool]:
    """Return road and station so far along a way, and whether it runs along s there.

    Raises:
        InvalidDocument: The way is shorter.
    """
    for leg in legs:
        length_m, is_along = abs(leg.to_m - leg.from_m), leg.to_m >= leg.from_m
        if way_m <= length_m + 0.01:
            return leg.road, leg.from_m + (way_m if is_along else -way_m), is_along
        way_m -= length_m
    raise fault_at(place, f"leads {way_m:.1f} m past the end of its route")


# Private


def _connect(network: RoadNetwork, first: Place, last: Place, place: str) -> Iterator[Leg]:
    (road, from_m, _, lane_id), (goal, to_m, _, _) = first, last
    end = END if road.is_forward(lane_id) else START
    if road.id == goal.id and (to_m >= from_m) == (end == END):
        yield Leg(road=road, from_m=from_m, to_m=to_m)
        return
    # By length, and in the order of finding: roads entered at an end, with the legs before; the
    # last leg has no end.
    queue: list[tuple[float, int, MapRoad, float, str, list[Leg]]]
    queue = [(0.0, 0, road, from_m, end, [])]
    seen, numbers = set[tuple[str, str]](), count(1)
    while queue:
        gone_m, _, road, from_m, end, legs = heappop(queue)
        if not end:
            yield from legs
            return
        if (road.id, end) in seen:
            continue
        seen.add((road.id, end))
        leg = Leg(road=road, from_m=from_m, to_m=0.0 if end == START else road.line.length_m)
        legs, gone_m = [*legs, leg], gone_m + abs(leg.to_m - from_m)
        for name, met in network.list_exits(road, end) if gone_m < _LONGEST_M else ():
            if name not in network.elements:
                continue  # a map may be a part of a larger one
            following = network.road(name, place)
            enters_m = 0.0 if met == START else following.line.length_m
            leaves = END if met == START else START
            heappush(queue, (gone_m, next(numbers), following, enters_m, leaves, legs))
            if name == goal.id:
                there = [*legs, Leg(road=following, from_m=enters_m, to_m=to_m)]
                there_m = gone_m + abs(to_m - enters_m)
                heappush(queue, (there_m, next(numbers), following, enters_m, "", there))
    raise fault_at(place, f"no road leads from road {first[0].id} to road {goal.id}")


def _number(element: Element, name: str) -> float:
    return read_float(element, name, element.tag, default=0.0)


def _project(road: MapRoad, pose: Pose) -> tuple[float, float]:
    """Return s and t of the nearest place of a road's reference line."""
    low_m, high_m = 0.0, road.line.length_m
    for _ in range(6):  # each time between the neighbours of the nearest of 200 stations
        s_m = np.linspace(low_m, high_m, 200)
        away_m = np.hypot(*(road.line.poses_at(s_m)[:, :2] - (pose.x_m, pose.y_m)).T)
        row = int(np.argmin(away_m))
        low_m, high_m = float(s_m[max(row - 1, 0)]), float(s_m[min(row + 1, 199)])
    x_m, y_m, heading_rad = road.line.poses_at(s_m[row : row + 1])[0].tolist()
    left_m = (pose.y_m - y_m) * math.cos(heading_rad) - (pose.x_m - x_m) * math.sin(heading_rad)
    return float(s_m[row]), left_m
