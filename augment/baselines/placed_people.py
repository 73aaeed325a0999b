"""Pedestrians and construction zones of the rule placer.

Zones are a taper, a line, a row or a ring of cones, and a worker. s runs along the ego's lane from
the ego's centre, d to the left of it.
"""

import math
from statistics import fmean

import numpy as np

from augment.baselines.placed_motions import give_motion
from augment.baselines.placing_ground import PlacingGround
from augment.checks.wish_places import find_across, is_exact
from augment.checks.wish_shapes import Placement, lay_out, ring_radius_m
from augment.errors import CannotPlace
from augment.geometry.frames import Pose
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent
from augment.scene.intent import ConesRequest, LaneChoice, Lateral, Post, Shape, WalkRequest
from augment.scene.lane_graph import LanePosition
from augment.scene.planned_mover import WALK_S

SHORTEST_M, LONGEST_M = 7.0, 29.0
"""interPlan's walks are 7 to 29 m long."""
_BEYOND_EDGE_M = 0.5
APART_M = 1.2
CONE_SPACING_M = 2.5
"""Between cones of which nobody says how far: interPlan's median."""
_EDGE_M = LENGTH_WIDTH_M[AgentType.TRAFFIC_CONE][1] / 2.0
"""A cone at a lane boundary stands inside of it."""
_WORKER_GAP_M = 1.6
"""How far from the cones a worker stands; interPlan's are 0.8 to 4.0 m from the nearest."""


def place_walkers(
    request: WalkRequest, ground: PlacingGround, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """Return the pedestrians: side by side along the road, or in a file behind the first.

    Raises:
        CannotPlace: The lanes end before.
    """
    added = []
    for index in range(request.count or 1):
        behind_m, along_m = 0.0, index * APART_M
        if request.is_file:
            behind_m, along_m = along_m, 0.0
            if 0 < index <= len(request.behind):
                behind_m = request.behind[index - 1].draw(rng)
        walker = _walker(request, ground, distance_m + along_m, behind_m)
        wish = request.motion
        if wish is not None:
            walker = give_motion(wish, ground, walker, rng)
        added.append(walker)
    return tuple(added)


def _walker(
    request: WalkRequest, ground: PlacingGround, distance_m: float, behind_m: float
) -> TrafficAgent:
    start = request.start or ground.kerb  # the rule placer refuses an open one
    place = ground.along(distance_m)
    from_m = _left_m(request.spot.lateral, ground)
    if from_m is None:
        from_m = start.sign * ground.lane(place).width_m / 4.0
        if not request.on_road:
            from_m = start.sign * (ground.road_edge_m(place.pose, start) + _BEYOND_EDGE_M)
    arrives = ground.along(distance_m + (request.drift_m or 0.0)).pose
    to_m = _left_m(request.end, ground)
    if to_m is None:
        edge_m = ground.road_edge_m(arrives, start.other) + _BEYOND_EDGE_M
        to_m = -start.sign * edge_m
    begin = np.array(place.pose.beside(from_m + start.sign * behind_m))
    end = np.array(arrives.beside(to_m))
    length_m = walked_m = math.dist(begin, end)
    if request.end is None:
        walked_m = min(max(length_m, SHORTEST_M), LONGEST_M)
    end = begin + (end - begin) * (walked_m / length_m)
    (x_m, y_m), (to_x_m, to_y_m) = begin.tolist(), end.tolist()
    return TrafficAgent.at(
        AgentType.PEDESTRIAN,
        Pose(x_m=x_m, y_m=y_m, heading_rad=math.atan2(to_y_m - y_m, to_x_m - x_m)),
        lane_id=ground.graph.under(x_m, y_m),
        speed_mps=round(request.speed_mps or walked_m / WALK_S, 2),
        walk_to_m=(to_x_m, to_y_m),
    )


def _left_m(lateral: Lateral | None, ground: PlacingGround) -> float | None:
    """Return how far left of the lane's centre an offset leads, None where none is said."""
    sign = ground.side_sign(lateral)
    if lateral is None or (lateral.offset is None and sign):
        return None
    return sign * lateral.offset.low_m if lateral.offset else 0.0


def place_cones(
    request: ConesRequest, ground: PlacingGround, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """Return the cones in order, then the worker; ids are still empty.

    Raises:
        CannotPlace: The lanes end before the last cone, or there is no such lane.
    """
    spacing_m = CONE_SPACING_M if request.spacing is None else request.spacing.draw(rng)
    if spacing_m < 2.0 * _EDGE_M:
        raise CannotPlace(f"Cones {spacing_m:g} m apart would stand in each other.")
    lane = request.spot.lane
    edge_m = ground.lane(ground.beside(distance_m, lane)).width_m / 2.0 - _EDGE_M
    places = _places(request, ground, distance_m, spacing_m, edge_m)
    standing = [(AgentType.TRAFFIC_CONE, place) for place in places]
    if request.has_worker:
        standing.append((AgentType.PEDESTRIAN, _worker(request, ground, places)))
    added = []
    for kind, spot in standing:
        place = _at(ground, lane, spot)
        on_lane = abs(place.d_m) <= ground.lane(place).width_m / 2.0
        lane_id = place.lane_id if on_lane else ground.lane_at(place.pose)
        added.append(TrafficAgent.at(kind, place.pose, lane_id=lane_id))
    return tuple(added)


def _at(ground: PlacingGround, lane: LaneChoice | None, place: Placement) -> LanePosition:
    """The place (s, d): s along the ego's lane, d from the centre of the lane asked for."""
    s_m, d_m = place
    centre = ground.beside(s_m, lane)
    sign = -1.0 if lane is LaneChoice.ONCOMING else 1.0
    return ground.graph.place(centre.lane_id, centre.s_m, sign * d_m)


def _places(
    request: ConesRequest,
    ground: PlacingGround,
    distance_m: float,
    spacing_m: float,
    edge_m: float,
) -> list[Placement]:
    count = request.count or 1
    if request.reach_m is not None and request.reach_m < 2.0 * _EDGE_M * max(count - 1, 1):
        raise CannotPlace(f"{count} cones have no room on {request.reach_m:g} m.")
    if request.shape is Shape.RING and count < 3:
        raise CannotPlace("A ring needs at least three cones.")
    is_oblong = request.shape is Shape.RING and ring_radius_m(count, spacing_m) > edge_m
    lateral, to = request.spot.lateral, 0.0
    sign = ground.side_sign(lateral, request.spot.lane) or float(request.both_sides)
    from_m = fmean(find_across(lateral, sign, 2.0 * (edge_m + _EDGE_M), 2.0 * _EDGE_M))
    if request.shape is Shape.LINE and not is_exact(lateral):
        from_m = edge_m * sign
    elif request.shape is Shape.TAPER:
        from_m = (request.start or ground.kerb).sign * edge_m
        to = 0.0 if request.ends_in_middle else -from_m
    elif is_oblong:
        to = min(spacing_m / 2.0, edge_m)
    return lay_out(request, count, (distance_m, spacing_m, from_m, to), is_oblong=is_oblong)


def _worker(request: ConesRequest, ground: PlacingGround, places: list[Placement]) -> Placement:
    """Return the worker's place: the requested one, else the usual one at such a shape."""
    (first_s, first_d), (last_s, last_d) = places[0], places[-1]
    if request.shape is Shape.RING:
        return sum(s for s, _ in places) / len(places), 0.0
    if request.post is Post.AT_LAST or request.post_side is not None:
        near = places[-2:] if request.post is Post.AT_LAST else places
        side = (request.post_side or request.start or ground.kerb).sign
        middle_m = sum(s for s, _ in near) / len(near)
        return middle_m, sum(d for _, d in near) / len(near) + side * _WORKER_GAP_M
    if request.shape is Shape.ROW:
        return first_s + _WORKER_GAP_M, 0.0
    if request.shape is Shape.TAPER:
        # Beside the middle of the taper, on the side that it closes.
        length_m = math.hypot(last_s - first_s, last_d - first_d)
        if length_m == 0.0:
            return first_s + _WORKER_GAP_M, first_d
        along, across = (last_s - first_s) / length_m, abs(last_d - first_d) / length_m
        sign = (request.start or ground.kerb).sign
        middle_s, middle_d = (first_s + last_s) / 2.0, (first_d + last_d) / 2.0
        return middle_s + across * _WORKER_GAP_M, middle_d + sign * along * _WORKER_GAP_M
    if request.post is Post.BEHIND:
        return last_s + _WORKER_GAP_M, last_d
    # Beside the middle of a line: off the road if the line's outer side is, else in its lane.
    middle_m = (first_s + last_s) / 2.0
    gap_m = math.copysign(_WORKER_GAP_M, first_d or ground.kerb.sign)
    outside = _at(ground, request.spot.lane, (middle_m, first_d + gap_m))
    return middle_m, first_d + (gap_m if ground.lane_at(outside.pose) is None else -gap_m)
