"""Which way past what stands on the road is left to the ego, from the geometry alone.

Frame: s runs along the ego's route from its centre, d to the left of it, in metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from augment.checks import Ground
from augment.checks.situation import is_stopped
from augment.geometry.frames import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    EGO_LENGTH_M,
    EGO_WIDTH_M,
    Modification,
    Scene,
    TrafficAgent,
    apply,
)

FloatArray = NDArray[np.float64]

CLEARANCE_M = 0.3
"""On either side of the ego, as it passes."""
EDGE_M = 0.25
"""So far over the edge of its lane the ego is still in it."""
_FURTHEST_M = 9.0
_STEP_M = 0.1
_ALONG_M = 2.0


class WayPast(StrEnum):
    """By which lane the ego gets past."""

    OWN = "own lane"
    BESIDE = "lane beside it"
    ONCOMING = "oncoming lane"
    NONE = "none"


def way_past(scene: Scene, change: Modification) -> WayPast:
    """The first of own lane, lane beside it and oncoming lane that is wide enough.

    What moves or walks is waited for. The ego passes all that was changed at one offset from its
    route, from an ego's length before the first to one past the last, and off parking bays.
    """
    after = apply(scene, change)
    ground = Ground.of(after)
    changed = {one.id for one in change.changed}
    standing = [one for one in after.agents if is_stopped(one) and one.walk_to_m is None]
    route = ground.route
    if route is None or not changed & {one.id for one in standing}:
        return WayPast.OWN
    blocks = {one.id: _extent(route, one) for one in standing}
    own = [block for name, block in blocks.items() if name in changed]
    start_m = min(low[0] for low, _ in own) - EGO_LENGTH_M
    end_m = max(high[0] for _, high in own) + EGO_LENGTH_M
    beside = [block for block in blocks.values() if block[0][0] < end_m and block[1][0] > start_m]
    half_m = EGO_WIDTH_M / 2.0 + CLEARANCE_M
    free = [
        offset_m
        for offset_m in _OFFSETS_M
        if all(offset_m + half_m <= low[1] or offset_m - half_m >= high[1] for low, high in beside)
    ]
    stations_m = np.arange(start_m, end_m, _ALONG_M).tolist()
    ways = [_worst(ground, route, offset_m, stations_m) for offset_m in free]
    return min(ways, key=_RANK, default=WayPast.NONE)


# Private


_OFFSETS_M: list[float] = np.arange(-_FURTHEST_M, _FURTHEST_M + _STEP_M, _STEP_M).tolist()
_RANK = list(WayPast).index


def _extent(route: EgoRoute, agent: TrafficAgent) -> tuple[FloatArray, FloatArray]:
    """The least and the most (s, d) of an agent's box."""
    places = [route.locate(float(x), float(y)) for x, y in agent.box.corners_m]
    spots = np.array([(place.ahead_m, place.left_m) for place in places])
    return spots.min(axis=0), spots.max(axis=0)


def _worst(
    ground: Ground, route: EgoRoute, offset_m: float, stations_m: Sequence[float]
) -> WayPast:
    """The worst that lies under the ego's sides and middle at that offset."""
    half_m = EGO_WIDTH_M / 2.0 - EDGE_M
    found = WayPast.OWN
    for s_m in stations_m:
        for left_m in (offset_m - half_m, offset_m, offset_m + half_m):
            found = max(found, _under(ground, route, s_m, left_m), key=_RANK)
            if found is WayPast.NONE:
                return found
    return found


def _under(ground: Ground, route: EgoRoute, ahead_m: float, left_m: float) -> WayPast:
    x_m, y_m = route.position(ahead_m, left_m)
    if ground.road.distance_m(x_m, y_m) > 0.0 or ground.carparks.distance_m(x_m, y_m) == 0.0:
        return WayPast.NONE
    lanes = [one for one in ground.lanes.beside(x_m, y_m) if one.covers]
    if not lanes or any(one.lane_id in route.lane_ids for one in lanes):
        return WayPast.OWN
    tangent_rad = route.heading_at(ahead_m)
    turns = [abs(difference(one.tangent_rad, tangent_rad)) for one in lanes]
    return WayPast.BESIDE if min(turns) < math.pi / 4.0 else WayPast.ONCOMING
