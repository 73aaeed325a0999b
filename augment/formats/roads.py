"""A source's pieces of lane as lanes, connectors and areas in the ego frame of t0.

A segment outside intersections is a `Lane`; what follows it directly is its successor. Each way
through an intersection, from one lane to one other over one or more segments, is a
`LaneConnector` of its own, so that every connector has one beginning and one end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import islice

from augment.formats.road_map import MapExtract, Name, RoadMap, Way, following_of, ways_through
from augment.formats.roads import Strip, check_count, find_areas, find_strips, join
from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import Polyline
from augment.scene.entities import Lane, LaneConnector, TrafficLight
from augment.scene.lane_graph import traffic_side_of, turn_type_of

MOST_WAYS = 4_000


def road_around(city: RoadMap, ego: Pose) -> MapExtract:
    """The map around the ego.

    Args:
        city: The source's map.
        ego: The ego's centre in the world frame.

    Raises:
        InvalidDocument: A part has no shape; with the place and the reason of every fault.
    """
    strips = find_strips(city, ego)
    lane_ids = _lane_ids(strips)
    following = following_of({name: strip.segment for name, strip in strips.items()})
    inside = {name for name, strip in strips.items() if strip.segment.crosses}
    ways = list(islice(ways_through(following, inside), MOST_WAYS + 1))
    check_count(city, "ways through intersections", len(ways), MOST_WAYS)
    lanes = _lanes(strips, lane_ids, following)
    side = city.side if city.is_side_told else traffic_side_of(lanes)
    areas = find_areas(city, ego)
    return MapExtract(
        traffic_side=side or city.side,
        side_is_assumed=side is None,
        lanes=lanes,
        connectors=_connectors(ways, strips, lane_ids),
        areas=areas,
        far=len(city.segments) - len(strips) + len(city.areas) - len(areas),
    )


# Private


def _lane_ids(strips: dict[Name, Strip]) -> dict[Name, str]:
    plain = [name for name, strip in strips.items() if not strip.segment.crosses]
    plain.sort(key=lambda name: (round(strips[name].distance_m, 3), name))
    return {name: f"Lane{number}" for number, name in enumerate(plain, start=1)}


def _lanes(
    strips: dict[Name, Strip], lane_ids: dict[Name, str], following: dict[Name, list[Name]]
) -> tuple[Lane, ...]:
    return tuple(
        Lane(
            id=lane_id,
            centerline=strips[name].line,
            width_m=strips[name].width_m,
            speed_limit_mps=strips[name].segment.speed_limit_mps,
            left_boundary=strips[name].left,
            right_boundary=strips[name].right,
            left_neighbor=_neighbor(strips, lane_ids, name, strips[name].segment.left_neighbors),
            right_neighbor=_neighbor(strips, lane_ids, name, strips[name].segment.right_neighbors),
            successors=tuple(lane_ids[after] for after in following[name] if after in lane_ids),
        )
        for name, lane_id in lane_ids.items()
    )


def _neighbor(
    strips: dict[Name, Strip], lane_ids: dict[Name, str], name: Name, beside: tuple[Name, ...]
) -> str | None:
    """The id of the lane beside, unless it is oncoming: some maps name such neighbours too.

    Of several, along a long lane, the one nearest to its middle.
    """
    line = strips[name].line
    middle = line.pose_at(line.length_m / 2.0)
    found = []
    for other in beside:
        if other not in lane_ids or other == name:
            continue
        place = strips[other].line.project(middle.x_m, middle.y_m)
        heading = strips[other].line.heading_at(place.s_m)
        if abs(difference(heading, middle.heading_rad)) < math.pi / 2.0:
            found.append((round(place.distance_m, 3), other))
    return lane_ids[min(found)[1]] if found else None


def _connectors(
    found: list[Way], strips: dict[Name, Strip], lane_ids: dict[Name, str]
) -> tuple[LaneConnector, ...]:
    ways = [(way, join([strips[name].line for name in way.chain])) for way in found]
    ways.sort(key=lambda item: (round(item[1].project(0.0, 0.0).distance_m, 3), item[0].key))
    return tuple(
        _connector(f"Connector{number}", way, line, strips, lane_ids)
        for number, (way, line) in enumerate(ways, start=1)
    )


def _connector(
    connector_id: str,
    way: Way,
    line: Polyline,
    strips: dict[Name, Strip],
    lane_ids: dict[Name, str],
) -> LaneConnector:
    chain = [strips[name] for name in way.chain]
    limits = [strip.segment.speed_limit_mps for strip in chain]
    return LaneConnector(
        id=connector_id,
        from_lane=None if way.before is None else lane_ids[way.before],
        to_lane=None if way.after is None else lane_ids[way.after],
        centerline=line,
        width_m=_mean_width(chain),
        traffic_light=_light(chain, None if way.before is None else strips[way.before]),
        turn_type=(chain[0].segment.turn if len(chain) == 1 else None) or turn_type_of(line),
        speed_limit_mps=max((limit for limit in limits if limit is not None), default=None),
        left_boundary=_edge([strip.left for strip in chain]),
        right_boundary=_edge([strip.right for strip in chain]),
    )


def _edge(lines: Sequence[Polyline | None]) -> Polyline | None:
    known = [line for line in lines if line is not None]
    return join(known) if len(known) == len(lines) else None


def _light(chain: Sequence[Strip], before: Strip | None) -> TrafficLight:
    """The first state that is told along the way; the lane before may tell it for all."""
    told = [strip.segment.light for strip in (*chain, *([before] if before is not None else []))]
    states = [one for one in told if one not in (TrafficLight.UNKNOWN, TrafficLight.NONE)]
    return states[0] if states else chain[0].segment.light


def _mean_width(strips: Iterable[Strip]) -> float:
    widths = [(strip.width_m, strip.line.length_m) for strip in strips]
    total = sum(length for _, length in widths)
    return round(sum(width * length for width, length in widths) / total, 3)
