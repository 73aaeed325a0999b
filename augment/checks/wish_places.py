"""Geometry of where an intent admits one object: stations along the route, a range across it.

This is what a sentence says, without any tolerance: the checks hold an object against it, the
distance to the wish is the way to it, and the rule placer stands things inside of it. Named
places (before the intersection, in the bend, between parked vehicles) are stations too.

Frame: that of `EgoRoute`, ahead of the ego and left of its way; points are in the scene's.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.checks.ground import VEHICLES
from augment.checks.lanes_across import LanesAcross, find_mark, find_picked, list_crosswalks
from augment.geometry.frames import difference
from augment.scene import intent as wish
from augment.scene.entities import Point

Span = tuple[float, float]
"""From and to, in metres."""

EVERYWHERE: Span = (-math.inf, math.inf)
ACROSS_M = 30.0
"""How far beside the route anything is looked for."""
SLIGHT_M = 1.5
"""The end of the paper's range for a slight offset."""
FAR_OUT_M = 3.0
"""How far beside the road something may stand that is to stand beside it."""
EDGE_GAP_M = 0.1
"""What may be left between a box at the edge of a lane and that edge."""
_AT_JUNCTION_M = 10.0
_BEND_OVER_M, _BEND_RAD, _BEND_ENDS_M = 20.0, math.radians(8.0), 10.0
"""A bend turns by so much over so far; its ends reach a little into the straight."""
_ASIDE_M, _BESIDE_M = 1.0, 15.0
"""Who is parked beside the ego's way stands so far off it."""
_SAME_M = 1e-6
_STRIP_M = 0.25
"""From station to station; of a circle of 10 m so long a chord misses less than 1 mm."""


def list_stations(spot: wish.Spot, lanes: LanesAcross) -> tuple[Span, ...]:
    """Return the stations that a spot admits, in metres ahead of the ego.

    A number and a named place both hold; where they contradict each other the number does.

    Args:
        spot: With its distance counted from the ego, as `resolve_spots` leaves it.
        lanes: Of the scene.
    """
    spans = [spot.span_m or EVERYWHERE]
    for setting in spot.settings:
        # Several named places hold at once; one that leaves nothing is passed over.
        spans = _intersect(spans, list_named(setting, lanes)) or spans
    return tuple(spans)


def list_named(setting: wish.Setting, lanes: LanesAcross) -> list[Span]:
    """Return the stations of a named place; empty where the scene has none."""
    places = wish.Setting
    begin_m = find_mark(lanes, wish.MapPlace.JUNCTION_START)
    end_m = find_mark(lanes, wish.MapPlace.JUNCTION_END)
    match setting:
        case places.IN_BEND:
            return _list_bends(lanes)
        case places.ON_CROSSWALK:
            return list_crosswalks(lanes)
        case places.OFF_CROSSWALK:
            edges = [end for span in list_crosswalks(lanes) for end in span]
            # What lies between crosswalks: ends and beginnings in turn.
            ends = [-math.inf, *edges, math.inf]
            return list(zip(ends[::2], ends[1::2], strict=True))
        case places.BY_PARKED | places.BY_PARKED_LEFT | places.BY_PARKED_RIGHT:
            signs = {places.BY_PARKED_LEFT: (1.0,), places.BY_PARKED_RIGHT: (-1.0,)}
            rows = (_find_parked_row(lanes, sign) for sign in signs.get(setting, (1.0, -1.0)))
            return _join(row for row in rows if row is not None)
    if begin_m is None or end_m is None:
        return []
    return {
        places.BEFORE_INTERSECTION: [(-math.inf, begin_m)],
        places.IN_INTERSECTION: [(begin_m, end_m)],
        places.AT_INTERSECTION: [(begin_m - _AT_JUNCTION_M, end_m + _AT_JUNCTION_M)],
        places.AFTER_INTERSECTION: [(end_m, math.inf)],
    }[setting]


def list_absent(intent: wish.Intent, lanes: LanesAcross) -> tuple[str, ...]:
    """Return in words what the intent names and the scene does not have."""
    requests = (*intent.requests, *intent.moves)
    spots = [request.spot for request in requests]
    picks = [spot.landmark for spot in spots if spot.landmark is not None]
    picks += [*(move.who for move in intent.moves), *intent.removals]
    ways = dict.fromkeys(spot.via for spot in spots if lanes.over(spot.via) is None)
    marks = [spot.mark for spot in spots if spot.mark is not None]
    starts = [motion.start for one in requests if (motion := getattr(one, "motion", None))]
    marks += [start.mark for start in starts if start is not None and start.mark is not None]
    places = [setting for spot in spots for setting in spot.settings]
    absent = [f"a way to {via}" for via in ways]
    absent += [str(pick) for pick in picks if not find_picked(lanes, pick)]
    absent += [f"a place {setting}" for setting in places if not list_named(setting, lanes)]
    return (*absent, *(str(mark) for mark in marks if find_mark(lanes, mark) is None))


def find_across(lateral: wish.Lateral | None, sign: float, lane_m: float, box_m: float) -> Span:
    """Return from where to where left of its lane's centre an object may stand, in metres.

    Args:
        lateral: What the sentence says; None admits all of the lane.
        sign: The side of its target, 1 left, -1 right, 0 the centre.
        lane_m: Width of the lane.
        box_m: Width of the object.
    """
    half_lane_m, half_box_m = lane_m / 2.0, box_m / 2.0
    if lateral is None:
        return -half_lane_m, half_lane_m
    if sign == 0.0:
        return 0.0, 0.0
    outside_m = half_lane_m + half_box_m
    near_m, far_m = {
        None: (0.0, half_lane_m),
        wish.Nearness.SLIGHTLY: (0.0, SLIGHT_M),
        wish.Nearness.AT_EDGE: (half_lane_m - half_box_m - EDGE_GAP_M, half_lane_m),
        wish.Nearness.HALF_OUT: (half_lane_m, half_lane_m),
        wish.Nearness.OUTSIDE: (outside_m, outside_m + FAR_OUT_M),
    }[lateral.nearness]
    if lateral.offset is not None:
        near_m, far_m = lateral.offset.span_m
    # On the right near is the higher number, as left is positive.
    low_m, high_m = sorted((sign * near_m, sign * far_m))
    return low_m, high_m


def is_exact(lateral: wish.Lateral | None) -> bool:
    """Return whether it is said how far towards its target something stands."""
    return lateral is not None and (lateral.offset or lateral.nearness) is not None


def find_off(value: float, spans: Iterable[Span]) -> float:
    """Return how far a value is outside the nearest of some ranges, 0 within one."""
    return min(max(low - value, value - high, 0.0) for low, high in spans)


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """The points that are admitted for the centre of one object.

    Attributes:
        stations_m: Ahead of the ego.
        across: From where to where left of the route at a station; None where nowhere.
    """

    lanes: LanesAcross
    stations_m: tuple[Span, ...]
    across: Callable[[float], Span | None]

    @classmethod
    @lru_cache(maxsize=8)  # the answers of all contestants are held against the same places
    def of(cls, spot: wish.Spot, lanes: LanesAcross, box_m: float) -> "Place":
        """Return the place that a spot admits for an object of that width."""
        lane = spot.lane or (wish.LaneChoice.OWN if spot.lateral is not None else None)
        sign = lanes.side_sign(spot.lateral, spot.lane)

        def across(ahead_m: float) -> Span | None:
            if lane is None:
                return -ACROSS_M, ACROSS_M
            band = lanes.band(lane, ahead_m)
            if band is None:
                return None
            low_m, high_m = find_across(spot.lateral, sign, band.width_m, box_m)
            return band.left_m + low_m, band.left_m + high_m

        return cls(lanes=lanes, stations_m=list_stations(spot, lanes), across=across)

    def nearest(self, point: Point) -> Point:
        """Return the admitted point that is nearest to a point: itself where it is admitted.

        Where the lane that is asked for is nowhere, every point is.
        """
        here = self.lanes.route.locate(*point)
        span = self.across(here.ahead_m)
        # An admitted point stays as it is: strips would move it by their chords.
        is_there = find_off(here.ahead_m, self.stations_m) <= _SAME_M
        if is_there and span is not None and find_off(here.left_m, [span]) <= _SAME_M:
            return point
        if not len(self._pieces):
            return point
        # (pieces,) lines from each piece to the point.
        way = shapely.shortest_line(self._pieces, shapely.Point(point))
        (x_m, y_m), _ = shapely.get_coordinates(way[np.argmin(shapely.length(way))]).tolist()
        return x_m, y_m

    @cached_property
    def _pieces(self) -> NDArray[np.object_]:
        """The place in strips from station to station, as points, lines and polygons."""
        route = self.lanes.route
        reach = (-route.ego_s_m, route.line.length_m - route.ego_s_m)
        pieces = list[NDArray[np.object_]]()
        for low_m, high_m in _intersect(self.stations_m, [reach]):
            count = max(math.ceil((high_m - low_m) / _STRIP_M), 1) + (high_m > low_m)
            sides = [
                [route.position(station_m, left_m) for left_m in span]
                for station_m in np.linspace(low_m, high_m, count).tolist()
                if (span := self.across(station_m)) is not None
            ]
            # (S, 2, 2) the low and the high end at each station, as points in metres.
            ends = np.array(sides, dtype=np.float64).reshape(-1, 2, 2)
            # (S - 1, 4, 2) from one station to the next and back, round the strip between them.
            rings = np.concatenate([ends[:-1], ends[1:, ::-1]], axis=1)
            strips = shapely.make_valid(np.asarray(shapely.polygons(rings)))
            pieces += [np.asarray(shapely.linestrings(ends)), np.asarray(strips)]
        return np.concatenate(pieces) if pieces else np.array([], dtype=object)


def _intersect(spans: Iterable[Span], others: Sequence[Span]) -> list[Span]:
    both = ((max(a, c), min(b, d)) for a, b in spans for c, d in others)
    return [(low, high) for low, high in both if low <= high]


def _join(spans: Iterable[Span]) -> list[Span]:
    """Return the ranges in order, those that meet as one."""
    joined: list[Span] = []
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return joined


def _list_bends(lanes: LanesAcross) -> list[Span]:
    route, half_m = lanes.route, _BEND_OVER_M / 2.0
    # A station a metre, from 100 m behind the ego on.
    stations = np.arange(-min(route.ego_s_m, 100.0), route.ends_m[-1], 1.0).tolist()
    turns = [
        # The turn over 20 m around the station.
        abs(difference(route.heading_at(s + half_m), route.heading_at(s - half_m)))
        for s in stations
    ]
    inside = [s for s, turn in zip(stations, turns, strict=True) if turn >= _BEND_RAD]
    return _join((s - _BEND_ENDS_M, s + _BEND_ENDS_M) for s in inside)


def _find_parked_row(lanes: LanesAcross, sign: float) -> Span | None:
    """Return from where to where vehicles are parked on a side of the ego's way."""
    parked = (
        (lanes.route.locate_agent(agent), agent.length_m / 2.0)
        for agent in lanes.route.scene.agents
        if agent.type in VEHICLES and agent.is_stopped
    )
    ends = [
        (here.ahead_m - half_m, here.ahead_m + half_m)
        for here, half_m in parked
        if _ASIDE_M < sign * here.left_m <= _BESIDE_M
    ]
    return (min(ends)[0], max(end for _, end in ends)) if ends else None
