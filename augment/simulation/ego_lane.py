"""Which way the ego is on through a drive; it keeps a way as long as that makes sense."""

from __future__ import annotations

import numpy as np

from augment.simulation.road import Road
from augment.simulation.states import FloatArray, IntArray, wrap_angles

NO_WAY = -1
NEAR_M = 5.0
"""So far off every way the ego still counts as on the one it was on."""


def ego_ways(road: Road, centres_m: FloatArray, headings_rad: FloatArray) -> IntArray:
    """The index of the way at each moment (T,), `NO_WAY` off them all.

    The way stays the one it was while that contains the centre. Else one of the ways there is
    taken: one that follows the old way, then one of the route, then the best aligned.
    """
    inside = road.covering(centres_m)
    made = np.full(len(centres_m), NO_WAY, dtype=np.int64)
    before = NO_WAY
    for moment, row in enumerate(inside):
        candidates = np.flatnonzero(row)
        if before != NO_WAY and row[before]:
            made[moment] = before
        elif len(candidates):
            heading = float(headings_rad[moment])
            made[moment] = _pick(road, candidates, before, centres_m[moment], heading)
        elif before != NO_WAY and _near(road, before, centres_m[moment]):
            made[moment] = before
        before = int(made[moment])
    return made


def _pick(
    road: Road, candidates: IntArray, before: int, place_m: FloatArray, heading_rad: float
) -> int:
    after = set(road.graph.successors(road.names[before])) if before != NO_WAY else set()

    def misfit(number: int) -> tuple[bool, bool, float]:
        path = road.way_path(number)
        s_m, _ = path.beside(place_m[None])
        turn = float(wrap_angles(path.poses(s_m)[0, 2] - heading_rad))
        name = road.names[number]
        return name not in after, name not in road.beside, abs(turn)

    return min((int(number) for number in candidates), key=misfit)


def _near(road: Road, number: int, place_m: FloatArray) -> bool:
    import shapely

    return bool(shapely.distance(road.strips[number], shapely.Point(*place_m)) <= NEAR_M)
