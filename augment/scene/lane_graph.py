"""Lanes and connectors as one graph: what lies under a point, and what comes next.

A way is a lane or a lane connector; both are read by the four verbs of `Polyline`.
Frame: ego frame of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from augment.errors import UnknownName
from augment.geometry.angles import difference
from augment.geometry.frames import Pose
from augment.geometry.polyline import Projection
from augment.scene.entities import Lane, LaneConnector, Scene, TurnType

Way = Lane | LaneConnector

_TURN_ORDER = {TurnType.STRAIGHT: 0, TurnType.LEFT: 1, TurnType.RIGHT: 1, TurnType.U_TURN: 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceOnWay:
    """A place on a way: `s_m` along its centreline, `d_m` to the left of it."""

    way_id: str
    s_m: float
    d_m: float
    pose: Pose
    remaining_m: float


class LaneGraph:
    """The ways of one scene, by id, with their successors and predecessors."""

    def __init__(self, scene: Scene) -> None:
        ways: list[Way] = [*scene.lanes, *scene.connectors]
        self.ways: dict[str, Way] = {way.id: way for way in ways}
        self._next: dict[str, list[str]] = {way_id: [] for way_id in self.ways}
        self._previous: dict[str, list[str]] = {way_id: [] for way_id in self.ways}
        for lane in scene.lanes:
            for following in lane.successors:
                self._join(lane.id, following)
        for connector in scene.connectors:
            self._join(connector.from_lane, connector.id)
            self._join(connector.id, connector.to_lane)

    def way(self, way_id: str) -> Way:
        """The lane or connector of that id.

        Raises:
            UnknownName: There is none.
        """
        try:
            return self.ways[way_id]
        except KeyError:
            raise UnknownName("lane", way_id, sorted(self.ways)) from None

    def successors(self, way_id: str) -> tuple[str, ...]:
        """Ids of what follows, straightest first."""
        return tuple(sorted(self._next[way_id], key=lambda name: self._bend(way_id, name)))

    def predecessors(self, way_id: str) -> tuple[str, ...]:
        """Ids of what leads here, straightest first."""
        return tuple(
            sorted(self._previous[way_id], key=lambda name: self._bend_back(name, way_id))
        )

    def under(self, x_m: float, y_m: float, heading_rad: float | None = None) -> str | None:
        """The way whose width covers the point; of several the best aligned, else the nearest."""
        covering = [
            (self._misfit(way, place, heading_rad), way.id)
            for way in self._boxed(x_m, y_m)
            for place in [way.centerline.project(x_m, y_m)]
            if self._covers(way, place)
        ]
        return min(covering)[1] if covering else None

    def nearest(
        self, x_m: float, y_m: float, *, among: Iterable[str] | None = None
    ) -> tuple[str, Projection] | None:
        """The way whose centreline comes nearest to the point, None on a map without ways."""
        found = [
            (way_id, self.ways[way_id].centerline.project(x_m, y_m))
            for way_id in (self.ways if among is None else among)
        ]
        return min(found, key=lambda item: item[1].distance_m) if found else None

    def place(self, way_id: str, s_m: float, d_m: float = 0.0) -> PlaceOnWay:
        """The place s along one way and d to its left."""
        line = self.way(way_id).centerline
        return PlaceOnWay(
            way_id=way_id,
            s_m=s_m,
            d_m=d_m,
            pose=line.pose_at(s_m, d_m),
            remaining_m=line.length_m - s_m,
        )

    def along(
        self,
        way_id: str,
        start_m: float,
        distance_m: float,
        d_m: float = 0.0,
        *,
        turn: TurnType = TurnType.STRAIGHT,
    ) -> PlaceOnWay | None:
        """The place `distance_m` further (negative: back) along the lanes, None past the map.

        Where the lanes part, the way of that `turn` is taken, else the straightest.
        """
        here, s_m = way_id, start_m + distance_m
        seen = {here}
        while s_m > self.ways[here].centerline.length_m:
            following = self._choose(here, turn)
            if following is None or following in seen:
                return None
            s_m -= self.ways[here].centerline.length_m
            here = following
            seen.add(here)
        while s_m < 0.0:
            before = [name for name in self.predecessors(here) if name not in seen]
            if not before:
                return None
            here = before[0]
            seen.add(here)
            s_m += self.ways[here].centerline.length_m
        return self.place(here, s_m, d_m)

    def route(
        self, way_id: str, length_m: float, *, turn: TurnType = TurnType.STRAIGHT
    ) -> list[str]:
        """Ids of the ways from this one on, until `length_m` of them are collected."""
        route, total = [way_id], self.way(way_id).centerline.length_m
        while total < length_m:
            following = self._choose(route[-1], turn)
            if following is None or following in route:
                break
            route.append(following)
            total += self.ways[following].centerline.length_m
        return route

    def _boxed(self, x_m: float, y_m: float) -> list[Way]:
        """The ways in whose box the point lies; all others are more than half a width away."""
        low_x, low_y, high_x, high_y = self._boxes
        inside = (low_x <= x_m) & (x_m <= high_x) & (low_y <= y_m) & (y_m <= high_y)
        ways = list(self.ways.values())
        return [ways[index] for index in np.flatnonzero(inside)]

    @cached_property
    def _boxes(self) -> NDArray[np.float64]:
        """The box around each way, half a width out: least x, least y, most x, most y (4, W)."""
        boxes = [
            [
                *(way.centerline.points_m.min(axis=0) - way.width_m / 2.0 - 0.1),
                *(way.centerline.points_m.max(axis=0) + way.width_m / 2.0 + 0.1),
            ]
            for way in self.ways.values()
        ]
        return np.array(boxes, dtype=np.float64).reshape(-1, 4).T

    def _join(self, before: str | None, after: str | None) -> None:
        if before in self._next and after in self._previous:
            self._next[before].append(after)
            self._previous[after].append(before)

    def _choose(self, way_id: str, turn: TurnType) -> str | None:
        options = self.successors(way_id)
        wanted = [
            name
            for name in options
            if isinstance(way := self.ways[name], LaneConnector) and way.turn_type is turn
        ]
        return next(iter(wanted or options), None)

    def _bend(self, before: str, after: str) -> tuple[int, float]:
        """How far one turns from the end of a way to the end of the next."""
        line, earlier = self.ways[after].centerline, self.ways[before].centerline
        turn = difference(line.heading_at(line.length_m), earlier.heading_at(earlier.length_m))
        return self._turn_order(after), abs(turn)

    def _bend_back(self, before: str, after: str) -> tuple[int, float]:
        """The same for who comes from behind, start to start.

        Ways that merge end alike: what tells them apart is how they got there.
        """
        line, earlier = self.ways[after].centerline, self.ways[before].centerline
        turn = difference(line.heading_at(0.0), earlier.heading_at(0.0))
        return self._turn_order(before), abs(turn)

    def _turn_order(self, way_id: str) -> int:
        way = self.ways[way_id]
        return _TURN_ORDER[way.turn_type] if isinstance(way, LaneConnector) else 0

    @staticmethod
    def _covers(way: Way, place: Projection) -> bool:
        """Whether the point is within the lane's width and not beyond one of its ends."""
        inside = 1e-9 < place.s_m < way.centerline.length_m - 1e-9
        return place.distance_m <= way.width_m / 2.0 and (inside or place.distance_m < 0.05)

    @staticmethod
    def _misfit(way: Way, place: Projection, heading_rad: float | None) -> tuple[float, float]:
        if heading_rad is None:
            return 0.0, place.distance_m
        turn = abs(difference(way.centerline.heading_at(place.s_m), heading_rad))
        return round(turn / math.radians(15.0)), place.distance_m
