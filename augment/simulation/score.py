"""The driving score, and how close a drive came to going wrong.

The score is nuPlan's closed-loop score, or interPlan's by scenario type. Sources: nuPlan's metric
configuration and interPlan's aggregator, by the facts in docs/simulation.md, which also says what
differs. T moments.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import shapely

from augment.scene.entities import AgentType, Modification, ScenarioType
from augment.simulation import shapes
from augment.simulation.comfort import comfort_signals, is_comfortable
from augment.simulation.drive import Drive, Expert
from augment.simulation.road import Road
from augment.simulation.states import (
    AHEAD_RAD,
    BEHIND_RAD,
    HEADING,
    SPEED,
    STEP_S,
    BoolArray,
    FloatArray,
    IntArray,
    Kind,
    Objects,
    are_at_fault,
    classify_contacts,
)

NO_WAY = -1
NEAR_M = 5.0
"""So far off every way the ego still counts as on the one it was on."""
LITTLE_M = 2.0
# Share of the expert's way.
ENOUGH_PROGRESS = 0.2
# Steps of 0.1 s: the window of driving against a lane.
DIRECTION_STEPS = 11
WRONG_WAY_FREE_M, WRONG_WAY_HALF_M = 2.0, 6.0
MAX_OVERSPEED_MPS = 2.23
OFF_ROAD_M = 0.3
# nuPlan's bound, and how far ahead meetings are looked for.
LEAST_TTC_S = 0.95
TTC_HORIZON_S = 3.0
_STILL_MPS = 5e-3
# Values of interPlan's goal lane metric: beside the route at the end, and from the start.
OFF_GOAL_LANE = 0.5
NO_START = 0.2607
_CLASSES = (((Kind.PEDESTRIAN, Kind.BICYCLE), 0), ((Kind.VEHICLE,), 0), ((Kind.STATIC,), 1))
"""Who counts together, and how many collisions with them are allowed."""
_DETOUR = (
    ScenarioType.CONSTRUCTION_ZONE,
    ScenarioType.ACCIDENT_SITE,
    ScenarioType.NUDGE,
    ScenarioType.OVERTAKE,
)
"""Where the other direction's lane may be used: direction is then a weight of 1."""


class ScoreKind(StrEnum):
    """Benchmark whose score it is."""

    NUPLAN = "nuplan"
    INTERPLAN = "interplan"


@dataclass(frozen=True, slots=True)
class Metric:
    """A part of a score.

    Attributes:
        name: nuPlan's or interPlan's own.
        value: 0 to 1; None where it can't be said, and then it does not count.
        weight: Its weight in the weighted mean; None for a multiplier.
    """

    name: str
    value: float | None
    weight: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """The first contact with one object."""

    moment: int
    object_id: str
    kind: Kind
    at_fault: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score:
    """A drive's score.

    Attributes:
        value: 0 to 1.
        metrics: Its parts.
        collisions: Who was touched.
        expert: What progress was measured by.
    """

    value: float
    metrics: tuple[Metric, ...]
    collisions: tuple[Collision, ...]
    expert: Expert


def score_drive(
    drive: Drive,
    expert: Expert,
    *,
    kind: ScoreKind = ScoreKind.NUPLAN,
    scenario_type: ScenarioType | None = None,
    modification: Modification | None = None,
) -> Score:
    """Score a drive.

    Args:
        drive: What happened.
        expert: What progress is measured by.
        kind: nuPlan's or interPlan's.
        scenario_type: Decides the roles in interPlan's score; its defaults when None.
        modification: Names the obstacles that interPlan wants passed; none when None.
    """
    met, ratio = collisions(drive), progress_ratio(drive, expert)
    ways = _ego_ways(drive.road, drive.boxes[:, :2], drive.states[:, HEADING])
    is_detour = kind is ScoreKind.INTERPLAN and scenario_type in _DETOUR
    is_on_road, direction = float(outside_m(drive).max()) < OFF_ROAD_M, _direction(drive, ways)
    metrics = [
        Metric("no_ego_at_fault_collisions", _no_fault_collisions(met)),
        Metric("drivable_area_compliance", float(is_on_road)),
        Metric("ego_is_making_progress", float(ratio >= ENOUGH_PROGRESS)),
        Metric("driving_direction_compliance", direction, 1.0 if is_detour else None),
        Metric("ego_progress_along_expert_route", ratio, 5.0),
        Metric("time_to_collision_within_bound", _time_to_collision(drive, met), 5.0),
        Metric("speed_limit_compliance", _speed_limit(drive, ways), 4.0),
        Metric("ego_is_comfortable", _comfort(drive), 2.0),
    ]
    if kind is ScoreKind.INTERPLAN:
        metrics.append(Metric("lane_changes_to_goal", _lane_changes(drive.road, ways), 4.0))
        if scenario_type is not None:
            places = [] if modification is None else _obstacles(modification)
            passed = float(ratio >= _obstacles_end(drive.road, expert, places))
            metrics.append(Metric("ego_passed_obstacles", passed))
    parts = tuple(metrics)
    return Score(value=combine(parts), metrics=parts, collisions=met, expert=expert)


def combine(metrics: tuple[Metric, ...]) -> float:
    """Return the product of the multipliers times the weighted mean of the others, 0 to 1."""
    # What can't be said counts neither as a multiplier nor among the weights.
    product, total, weights = 1.0, 0.0, 0.0
    for metric in metrics:
        if metric.value is None:
            continue
        if metric.weight is None:
            product *= metric.value
        else:
            total += metric.weight * metric.value
            weights += metric.weight
    return product * (total / weights if weights else 1.0)


def collisions(drive: Drive) -> tuple[Collision, ...]:
    """Return who was touched, in the order of time.

    Who touches the ego at the very start is left out: nobody drove there.
    """
    met: list[Collision] = []
    hit_before: set[str] = set()
    astray = off_one_way(drive)
    for moment, objects in enumerate(drive.objects):
        touching = shapes.meet(
            np.broadcast_to(drive.boxes[moment], objects.boxes.shape), objects.boxes
        )
        # One contact with each object: a car that is pushed on is hit once.
        fresh = np.array([name not in hit_before for name in objects.ids], dtype=bool)
        hit = objects.chosen(touching & fresh)
        hit_before.update(hit.ids)
        if not len(hit) or moment == 0:
            continue
        states = np.repeat(drive.states[moment : moment + 1], len(hit), axis=0)
        contacts = classify_contacts(states, hit.boxes, hit.speeds_mps, hit.kinds, drive.body)
        faults = are_at_fault(contacts, np.repeat(astray[moment], len(hit)))
        met += (
            Collision(moment=moment, object_id=name, kind=Kind(kind), at_fault=bool(fault))
            for name, kind, fault in zip(hit.ids, hit.kinds, faults, strict=True)
        )
    return tuple(met)


def off_one_way(drive: Drive) -> BoolArray:
    """Return whether the ego is off the road, or not on one way and what follows it, (T,)."""
    boxes = shapes.corners(drive.boxes)
    off = ~drive.road.drivable.contains(boxes).all(axis=-1)
    return np.asarray(off | ~drive.road.on_one_way(boxes), dtype=np.bool_)


def outside_m(drive: Drive) -> FloatArray:
    """Return how far the ego's furthest corner is outside the drivable area, (T,)."""
    return np.asarray(drive.road.drivable.distance_m(shapes.corners(drive.boxes)).max(axis=1))


def progress_ratio(drive: Drive, expert: Expert) -> float:
    """Return the ego's advance as a share of the expert's, 0 to 1; 2 m are the least of both."""
    (start_m, end_m), _ = drive.road.centreline.beside(drive.boxes[[0, -1], :2])
    advance = float(end_m - start_m)
    if advance < -LITTLE_M:
        return 0.0
    return min(1.0, max(advance, LITTLE_M) / max(expert.progress_m, LITTLE_M))


def criticality(drive: Drive, met: tuple[Collision, ...]) -> dict[str, float | None]:
    """Return the smallest time to collision below 3 s, the least distance, the hardest braking.

    The distance is that between bodies. None where nothing of the kind happened; braking that
    nothing requires is 0.
    """
    ttc_s = float(_ttc_series(drive, met, only_relevant=False).min())
    closest = [
        float(shapely.distance(bodies, shapely.Polygon(shapes.corners(box))).min())
        for box, objects in zip(drive.boxes, drive.objects, strict=True)
        if len(objects)
        for bodies in [shapely.polygons(shapes.corners(objects.boxes))]
    ]
    return {
        "least_ttc_s": None if math.isinf(ttc_s) else ttc_s,
        "least_distance_m": min(closest, default=None),
        "required_braking_mps2": float(required_braking_mps2(drive).max()),
    }


def required_braking_mps2(drive: Drive) -> FloatArray:
    """Return the deceleration rate to avoid a crash (T,), 0 where nobody in the way is slower.

    DRAC = closing speed^2 / (2 gap), along the ego's way, of who is in front of it (Almqvist,
    Hyden and Risser 1991; SUMO's SSM device).
    """
    line, needed = drive.road.centreline, np.zeros(len(drive.states))
    for moment, (box, state, objects) in enumerate(
        zip(drive.boxes, drive.states, drive.objects, strict=True)
    ):
        # (A + 1, 4) corners along the way and left of it, the ego's first.
        everybody = shapes.corners(np.vstack([box[None], objects.boxes])).reshape(-1, 2)
        along_m, left_m = (places.reshape(-1, 4) for places in line.beside(everybody))
        heading_rad = line.poses(along_m.mean(axis=1))[:, 2]
        gaps_m = along_m[1:].min(axis=1) - along_m[0].max()
        in_way = (left_m[1:].min(axis=1) < left_m[0].max()) & (
            left_m[1:].max(axis=1) > left_m[0].min()
        )
        theirs = objects.speeds_mps * np.cos(objects.boxes[:, 2] - heading_rad[1:])
        closing = state[SPEED] * np.cos(state[HEADING] - heading_rad[0]) - theirs
        counts = in_way & (gaps_m > 0.0) & (closing > 0.0)
        rates = closing[counts] ** 2 / (2.0 * gaps_m[counts])
        needed[moment] = rates.max(initial=0.0)
    return needed


# Private


def _no_fault_collisions(met: tuple[Collision, ...]) -> float:
    """The product over the classes of max(0, 1 - collisions / (allowed + 1))."""
    value = 1.0
    for kinds, allowed in _CLASSES:
        count = sum(collision.at_fault and collision.kind in kinds for collision in met)
        value *= max(0.0, 1.0 - count / (allowed + 1))
    return value


def _ego_ways(road: Road, centres_m: FloatArray, headings_rad: FloatArray) -> IntArray:
    """The index of the way at each moment (T,), `NO_WAY` off them all.

    The way stays the one it was while that contains the centre. Else one of the ways there is
    taken: one that follows the old way, then one of the route, then the best aligned.
    """
    ways, before = np.full(len(centres_m), NO_WAY, dtype=np.int64), NO_WAY
    for moment, row in enumerate(road.covering(centres_m)):
        candidates, place_m = np.flatnonzero(row), centres_m[moment]
        # Ways overlap in intersections: staying avoids jumps between them.
        if before != NO_WAY and row[before]:
            ways[moment] = before
        elif len(candidates):
            ways[moment] = _pick_way(road, candidates, before, place_m, headings_rad[moment])
        elif before != NO_WAY:
            away_m = shapely.distance(road.strips[before], shapely.Point(*place_m))
            ways[moment] = before if away_m <= NEAR_M else NO_WAY
        before = int(ways[moment])
    return ways


def _pick_way(
    road: Road, candidates: IntArray, before: int, place_m: FloatArray, heading_rad: float
) -> int:
    after = road.graph.successors(road.names[before]) if before != NO_WAY else ()

    def misfit(number: int) -> tuple[bool, bool, float]:
        path, name = road.way_path(number), road.names[number]
        turn = shapes.wrap_angles(path.poses(np.array(path.station_of(place_m)))[2] - heading_rad)
        return name not in after, name not in road.beside, abs(float(turn))

    return min((int(number) for number in candidates), key=misfit)


def _direction(drive: Drive, ways: IntArray) -> float:
    """Return 1, 0.5 or 0 by the longest way against the lane in 1.1 s: < 2 m, < 6 m, else.

    The first two moments on another way count nothing.
    """
    centres = drive.boxes[:, :2]
    steps, fresh = np.zeros(len(centres)), 2
    for moment in range(1, len(centres)):
        fresh = fresh + 1 if ways[moment] == ways[moment - 1] else 0
        if ways[moment] != NO_WAY and fresh >= 2:
            path = drive.road.way_path(int(ways[moment]))
            (before, here), _ = path.beside(centres[moment - 1 : moment + 1])
            steps[moment] = here - before
    # (T,) metres gone along the lanes in the last 1.1 s; negative is against them.
    window = np.convolve(steps, np.ones(DIRECTION_STEPS))[: len(steps)]
    against_m = -float(window.min())
    if against_m < WRONG_WAY_FREE_M:
        return 1.0
    return 0.5 if against_m < WRONG_WAY_HALF_M else 0.0


def _speed_limit(drive: Drive, ways: IntArray) -> float | None:
    """1 less the overspeed, integrated and held against 2.23 m/s throughout."""
    # (T,); NO_WAY is -1, which reads the NaN at the end.
    limits = np.append(drive.road.limits_mps, np.nan)[ways]
    if np.isnan(limits).all():
        return None
    over = np.nan_to_num(np.maximum(drive.states[:, SPEED] - limits, 0.0))
    most = MAX_OVERSPEED_MPS * max(drive.duration_s, STEP_S)
    return max(0.0, 1.0 - float(over.sum()) * STEP_S / most)


def _comfort(drive: Drive) -> float | None:
    """1 if every signal stays within its limits throughout."""
    if len(drive.states) < 2:
        return None
    return float(is_comfortable(comfort_signals(drive.states, drive.body)))


def _time_to_collision(drive: Drive, met: tuple[Collision, ...]) -> float:
    """1 if every moment's time to collision is above 0.95 s, and nobody is hit at fault."""
    lowest_s = float(_ttc_series(drive, met, only_relevant=True).min())
    return float(lowest_s > LEAST_TTC_S and not any(collision.at_fault for collision in met))


def _ttc_series(drive: Drive, met: tuple[Collision, ...], *, only_relevant: bool) -> FloatArray:
    """The time (T,) after which ego and somebody meet if both go on; inf for never.

    Args:
        drive: What happened.
        met: Its collisions; who was met already is left out from then on.
        only_relevant: Only who is ahead, or beside an ego that is not on one way or in an
            intersection, as nuPlan has it.
    """
    first = {collision.object_id: collision.moment for collision in met}
    times = np.full(len(drive.states), np.inf)
    loose = off_one_way(drive) | drive.road.intersections.contains(drive.boxes[:, :2])
    for moment, objects in enumerate(drive.objects):
        state = drive.states[moment]
        if state[SPEED] <= _STILL_MPS or not len(objects):
            continue
        is_counted = np.array([first.get(name, moment + 1) > moment for name in objects.ids])
        if only_relevant:
            angle = shapes.bearings(state[None], objects.boxes[:, :2])
            is_counted &= (angle < AHEAD_RAD) | (loose[moment] & (angle <= BEHIND_RAD))
        times[moment] = _first_meeting(drive.boxes[moment], state, objects.chosen(is_counted))
    return times


def _first_meeting(box: FloatArray, state: FloatArray, objects: Objects) -> float:
    """The first of 0.1, 0.2 ... 2.9 s at which the ego's box meets one of the objects."""
    # (S,) moments ahead.
    times = np.arange(1, round(TTC_HORIZON_S / STEP_S)) * STEP_S
    fastest = abs(state[SPEED]) + np.abs(objects.speeds_mps)
    # Who is further away than both can drive in that time is left out, (A,).
    reach = shapes.radii(objects.boxes) + shapes.radii(box) + times[-1] * fastest
    near = ((objects.boxes[:, :2] - box[:2]) ** 2).sum(axis=1) <= reach**2
    # (S, A', 5), the ego's box beside each.
    theirs = objects.chosen(near).later(times)
    mine = np.broadcast_to(box, theirs.shape).copy()
    mine[..., :3] = shapes.move_ahead(mine, (times * state[SPEED])[:, None])
    hit = shapes.meet(mine, theirs).any(axis=1)
    return float(times[hit.argmax()]) if hit.any() else float("inf")


def _obstacles(modification: Modification) -> list[tuple[float, float]]:
    """The places that interPlan wants passed: standing vehicles, cones, and where walks end."""
    places = []
    for agent in modification.changed:
        is_standing = agent.type in (AgentType.VEHICLE, AgentType.BUS) and agent.speed_mps <= 0.0
        if agent.walk_to_m is not None:
            places.append(agent.walk_to_m)
        elif is_standing or agent.type is AgentType.TRAFFIC_CONE:
            places.append((agent.x_m, agent.y_m))
    return places


def _obstacles_end(road: Road, expert: Expert, places: list[tuple[float, float]]) -> float:
    """The furthest of some places as a share of the expert's way."""
    if not places or expert.progress_m <= 0.0:
        return 0.0
    stations, _ = road.centreline.beside(np.array(places))
    furthest_m = float(stations.max()) - expert.start_m
    return min(max(furthest_m / expert.progress_m, 0.0), 1.0)


def _lane_changes(road: Road, ways: IntArray) -> float:
    """1 if the drive ends on the route, 0.5 elsewhere; our goals never need a lane change."""
    on_start, on_end = (way >= 0 and road.names[way] in road.route for way in ways[[0, -1]])
    if not on_start:
        return NO_START
    return 1.0 if on_end else OFF_GOAL_LANE
