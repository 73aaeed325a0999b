"""Routes of OpenSCENARIO: the shortest way along roads from waypoint to waypoint.

A route leaves its first road the way that cars drive on the waypoint's lane.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise

from augment.foreign import fault_at
from augment.formats.opendrive.network import END, START, MapRoad, RoadNetwork

_LONGEST_M = 20_000.0
Place = tuple[MapRoad, float, float, int]
"""Road, s and t there, and the id of the lane."""


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
    # By length, and in the order of finding: roads entered at an end, with the legs before.
    queue: list[tuple[float, int, MapRoad, float, str, list[Leg]]]
    queue = [(0.0, 0, road, from_m, end, [])]
    seen, number = set[tuple[str, str]](), 0
    while queue:
        gone_m, _, road, from_m, end, before = heappop(queue)
        leg = Leg(road=road, from_m=from_m, to_m=0.0 if end == START else road.line.length_m)
        legs, gone_m = [*before, leg], gone_m + abs(leg.to_m - from_m)
        for name, met in network.list_exits(road, end) if gone_m < _LONGEST_M else ():
            if (name, met) in seen:
                continue
            seen.add((name, met))
            following = network.road(name, place)
            enters_m = 0.0 if met == START else following.line.length_m
            if name == goal.id:
                yield from [*legs, Leg(road=following, from_m=enters_m, to_m=to_m)]
                return
            number += 1
            leaves = END if met == START else START
            heappush(queue, (gone_m, number, following, enters_m, leaves, legs))
    raise fault_at(place, f"no road leads from road {first[0].id} to road {goal.id}")
