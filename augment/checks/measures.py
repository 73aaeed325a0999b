"""What helps to measure a picture by eye: lines where something is asked for, and lane edges.

In: the ground of a scene and what its instruction asks for. Out: lines in the frame of the
scene. No change to the scene and nobody's answer is known here, so they are the same whoever
drew what.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from augment.checks.ground import Ground
from augment.checks.lanes_across import LanesAcross, resolve_spots
from augment.geometry.frames import difference
from augment.scene.entities import Point
from augment.scene.intent import Intent, LaneChoice, Spot, WalkRequest

_BESIDE_M = 1.0
"""How far a line across the road reaches beyond the outer edges of the lanes it is about."""
_WALK_M = 5.0
"""So far beyond where people walk, who begin beside the road."""
_ALONG_M = 6.0
"""How far a line along the lane reaches beyond the places that are asked for."""
_OPEN_M = (0.0, 40.0)
"""Where a line along the lane runs if no distance is asked for."""
_STEP_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureLine:
    """A line of two points or more: across the road, or along a lane.

    Attributes:
        points_m: Of the line.
        ahead_m: Of a line across: its place along the ego's route, negative behind the ego.
        left_m: Of a line along: its place left of the lane's centre, negative right of it.
    """

    points_m: tuple[Point, ...]
    ahead_m: float | None = None
    left_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneEdges:
    """How far a point within a lane is from its edges; sides are those of the ego's direction."""

    left_m: float
    right_m: float


def find_measures(ground: Ground, intent: Intent | None) -> tuple[MeasureLine, ...]:
    """Return the lines of a scenario; none without an intent or a lane under the ego.

    A line across the road lies so far along the ego's route as is asked for, one at each end of a
    range; a line along the lane lies so far from the lane's centre. What is asked for without a
    number has none.
    """
    lanes = None if intent is None else LanesAcross.of(ground, intent.route)
    if intent is None or lanes is None:
        return ()
    counted = resolve_spots(intent, lanes)
    lines: list[MeasureLine] = []
    for part in (*counted.requests, *counted.moves):
        span_m = part.spot.span_m if part.spot.distance else None
        ends_m = sorted({end for end in span_m or () if math.isfinite(end)})
        beyond_m = _WALK_M if isinstance(part, WalkRequest) else _BESIDE_M
        lines += [_across(part.spot, lanes, ahead_m, beyond_m) for ahead_m in ends_m]
        lines += _along(part.spot, lanes, ends_m)
    return tuple(dict.fromkeys(lines))


def lane_edges_at(ground: Ground, x_m: float, y_m: float) -> LaneEdges | None:
    """Return how far a point is from the edges of the lane under it, None off every lane.

    Where several lanes lie over each other, a lane goes before the connectors of a junction, and
    of several the one whose centre is nearest.
    """
    connectors = {connector.id for connector in ground.scene.connectors}
    under = min(
        (place for place in ground.graph.beside(x_m, y_m) if place.covers),
        key=lambda place: (place.lane_id in connectors, abs(place.d_m)),
        default=None,
    )
    if under is None:
        return None
    turn_rad = abs(difference(under.tangent_rad, ground.scene.ego.heading_rad))
    left_m = -under.d_m if turn_rad > math.pi / 2.0 else under.d_m
    half_m = under.width_m / 2.0
    return LaneEdges(left_m=half_m - left_m, right_m=half_m + left_m)


# Private


def _across(spot: Spot, lanes: LanesAcross, ahead_m: float, beyond_m: float) -> MeasureLine:
    """Over the ego's lane and the one that is asked for."""
    bands = [lanes.band(choice, ahead_m) for choice in (LaneChoice.OWN, spot.lane) if choice]
    edges_m = [
        band.left_m + side * band.width_m / 2.0 for band in bands if band for side in (-1.0, 1.0)
    ] or [-2.0, 2.0]
    low_m, high_m = min(edges_m) - beyond_m, max(edges_m) + beyond_m
    ends = tuple(lanes.route.position(ahead_m, left_m) for left_m in (high_m, low_m))
    return MeasureLine(points_m=ends, ahead_m=ahead_m)


def _along(spot: Spot, lanes: LanesAcross, ends_m: list[float]) -> Iterator[MeasureLine]:
    """Beside the centre of the lane that is asked for, as far as is said."""
    lateral = spot.lateral
    if lateral is None or spot.lane is None:
        return
    sign = lanes.side_sign(lateral)
    if sign and lateral.offset is None:
        return
    offsets_m = {0.0} if lateral.offset is None else {lateral.offset.low_m, lateral.offset.high_m}
    low_m, high_m = (ends_m[0], ends_m[-1]) if ends_m else _OPEN_M
    band = lanes.band(spot.lane, (low_m + high_m) / 2.0)
    if band is None:
        return
    steps = math.ceil((high_m - low_m + 2.0 * _ALONG_M) / _STEP_M)
    for offset_m in sorted({sign * offset_m for offset_m in offsets_m}):
        points = tuple(
            lanes.route.position(low_m - _ALONG_M + step * _STEP_M, band.left_m + offset_m)
            for step in range(steps + 1)
        )
        yield MeasureLine(points_m=points, left_m=offset_m)
