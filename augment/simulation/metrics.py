"""The parts of a driving score: nuPlan's, and what interPlan's score adds."""

from dataclasses import dataclass, field

import numpy as np
import shapely

from augment.scene.entities import AgentType, Modification, ScenarioType
from augment.simulation.drive import Drive, Expert
from augment.simulation.proposal_scores import comfort_signals, is_comfortable
from augment.simulation.road import Road
from augment.simulation.states import (
    AHEAD_RAD,
    BEHIND_RAD,
    SPEED,
    STEP_S,
    BoolArray,
    Contact,
    FloatArray,
    IntArray,
    Kind,
    Objects,
    are_at_fault,
    bearings,
    classify_contacts,
    corners,
    meet,
    moved_ahead,
    radii,
    wrap_angles,
)

NO_WAY = -1
NEAR_M = 5.0
"""So far off every way the ego still counts as on the one it was on."""
LITTLE_M = 2.0
ENOUGH_PROGRESS = 0.2
DIRECTION_STEPS = 11
WRONG_WAY_FREE_M, WRONG_WAY_HALF_M = 2.0, 6.0
MAX_OVERSPEED_MPS = 2.23
OFF_ROAD_M = 0.3
LEAST_TTC_S = 0.95
TTC_HORIZON_S = 3.0
_STILL_MPS = 5e-3
OFF_GOAL_LANE = 0.5
NO_START = 0.2607
_CLASSES = {
    "vulnerable_road_users": ((Kind.PEDESTRIAN, Kind.BICYCLE), 0),
    "vehicles": ((Kind.VEHICLE,), 0),
    "things": ((Kind.STATIC,), 1),
}
"""Who counts together, and how many collisions with them are allowed."""
_DETOUR = (
    ScenarioType.CONSTRUCTION_ZONE,
    ScenarioType.ACCIDENT_SITE,
    ScenarioType.NUDGE,
    ScenarioType.OVERTAKE,
)


def ego_ways(road: Road, centres_m: FloatArray, headings_rad: FloatArray) -> IntArray:
    """Return the index of the way at each moment (T,), `NO_WAY` off them all.

    The way stays the one it was while that contains the centre. Else one of the ways there is
    taken: one that follows the old way, then one of the route, then the best aligned.
    """
    ways = np.full(len(centres_m), NO_WAY, dtype=np.int64)
    before = NO_WAY
    for moment, row in enumerate(road.covering(centres_m)):
        candidates, place_m = np.flatnonzero(row), centres_m[moment]
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
        turn = wrap_angles(path.poses(np.array(path.station_of(place_m)))[2] - heading_rad)
        return name not in after, name not in road.beside, abs(float(turn))

    return min((int(number) for number in candidates), key=misfit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """The first contact with one object."""

    moment: int
    object_id: str
    kind: Kind
    contact: Contact
    at_fault: bool


def collisions(drive: Drive) -> tuple[Collision, ...]:
    """Return who was touched, in the order of time.

    Who touches the ego at the very start is left out: nobody drove there.
    """
    met: list[Collision] = []
    known: set[str] = set()
    astray = off_one_way(drive)
    for moment, objects in enumerate(drive.objects):
        touching = meet(np.broadcast_to(drive.boxes[moment], objects.boxes.shape), objects.boxes)
        fresh = np.array([name not in known for name in objects.ids], dtype=bool)
        hit = objects.chosen(touching & fresh)
        known.update(hit.ids)
        if not len(hit) or moment == 0:
            continue
        states = np.repeat(drive.states[moment : moment + 1], len(hit), axis=0)
        contacts = classify_contacts(states, hit.boxes, hit.speeds_mps, hit.kinds, drive.body)
        guilty = are_at_fault(contacts, astray[[moment] * len(hit)])
        met += [
            Collision(
                moment=moment,
                object_id=name,
                kind=Kind(kind),
                contact=Contact(contact),
                at_fault=bool(fault),
            )
            for name, kind, contact, fault in zip(
                hit.ids, hit.kinds, contacts, guilty, strict=True
            )
        ]
    return tuple(met)


def off_one_way(drive: Drive) -> BoolArray:
    """Return whether the ego is off the road, or not on one way and what follows it, (T,)."""
    boxes = corners(drive.boxes)
    off = ~drive.road.drivable.contains(boxes).all(axis=-1)
    return np.asarray(off | ~drive.road.on_one_way(boxes), dtype=np.bool_)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Metric:
    """A metric with how it came about.

    Attributes:
        name: nuPlan's or interPlan's own.
        value: 0 to 1; None where it can't be said, and then it does not count.
        weight: Its weight in the weighted mean; None for a multiplier.
        parts: Numbers that led to the value, by name.
    """

    name: str
    value: float | None
    weight: float | None = None
    parts: dict[str, float] = field(default_factory=dict)


def combine(metrics: tuple[Metric, ...]) -> float:
    """Return the product of the multipliers times the weighted mean of the others, 0 to 1."""
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


def progress_ratio(drive: Drive, expert: Expert) -> float:
    """Return the ego's advance as a share of the expert's, 0 to 1; 2 m are the least of both."""
    advance = ego_advance_m(drive)
    if advance < -LITTLE_M:
        return 0.0
    return min(1.0, max(advance, LITTLE_M) / max(expert.progress_m, LITTLE_M))


def ego_advance_m(drive: Drive) -> float:
    """Return how far the ego's centre came along the centreline."""
    stations, _ = drive.road.centreline.beside(drive.boxes[[0, -1], :2])
    return float(stations[1] - stations[0])


def progress(drive: Drive, expert: Expert) -> Metric:
    """How far the ego came, measured by the expert."""
    parts = {"ego_m": ego_advance_m(drive), "expert_m": expert.progress_m}
    ratio = progress_ratio(drive, expert)
    return Metric(name="ego_progress_along_expert_route", value=ratio, weight=5.0, parts=parts)


def making_progress(drive: Drive, expert: Expert) -> Metric:
    """1 from a ratio of 0.2 on."""
    ratio = progress_ratio(drive, expert)
    value = float(ratio >= ENOUGH_PROGRESS)
    return Metric(name="ego_is_making_progress", value=value, parts={"ratio": ratio})


def direction(drive: Drive, ways: IntArray, *, weight: float | None = None) -> Metric:
    """By the longest way against the lane's direction in 1.1 s: < 2 m is 1, < 6 m 0.5, else 0.

    The first two moments on another way count nothing.
    """
    centres = drive.boxes[:, :2]
    steps = np.zeros(len(centres))
    fresh = 2
    for moment in range(1, len(centres)):
        fresh = fresh + 1 if ways[moment] == ways[moment - 1] else 0
        if ways[moment] != NO_WAY and fresh >= 2:
            path = drive.road.way_path(int(ways[moment]))
            (before, here), _ = path.beside(centres[moment - 1 : moment + 1])
            steps[moment] = here - before
    window = np.convolve(steps, np.ones(DIRECTION_STEPS))[: len(steps)]
    against = max(0.0, -float(window.min()))
    half = 0.5 if against < WRONG_WAY_HALF_M else 0.0
    return Metric(
        name="driving_direction_compliance",
        value=1.0 if against < WRONG_WAY_FREE_M else half,
        weight=weight,
        parts={"against_m": against},
    )


def speed_limit(drive: Drive, ways: IntArray) -> Metric:
    """1 less the overspeed, integrated and held against 2.23 m/s throughout."""
    limits = np.append(drive.road.limits_mps, np.nan)[ways]
    over = np.nan_to_num(np.maximum(drive.states[:, SPEED] - limits, 0.0))
    most = MAX_OVERSPEED_MPS * max(drive.duration_s, STEP_S)
    is_known = not np.isnan(limits).all()
    return Metric(
        name="speed_limit_compliance",
        value=max(0.0, 1.0 - float(over.sum()) * STEP_S / most) if is_known else None,
        weight=4.0,
        parts={"most_over_mps": float(over.max())},
    )


def red_lights(drive: Drive) -> Metric:
    """0 if the ego's front ever crosses a red stop line; nuPlan has no such metric."""
    stations, _ = drive.road.centreline.beside(drive.boxes[:, :2])
    front = stations + drive.body.length_m / 2.0
    red = drive.road.red_stations_m
    crossed = ((front[:-1, None] < red) & (front[1:, None] >= red)).any(axis=1)
    parts = {"crossed": float(crossed.sum())}
    return Metric(name="red_light_compliance", value=float(not crossed.any()), parts=parts)


def comfort(drive: Drive) -> Metric:
    """1 if every signal stays within its limits throughout."""
    if len(drive.states) < 2:
        return Metric(name="ego_is_comfortable", value=None, weight=2.0)
    signals = comfort_signals(drive.states, drive.body)
    parts = {f"most_{name}": float(np.abs(series).max()) for name, series in signals.items()}
    value = float(is_comfortable(signals))
    return Metric(name="ego_is_comfortable", value=value, weight=2.0, parts=parts)


def no_fault_collisions(met: tuple[Collision, ...]) -> Metric:
    """The product over the classes of max(0, 1 - collisions / (allowed + 1))."""
    value, parts = 1.0, {"not_at_fault": float(sum(not collision.at_fault for collision in met))}
    for name, (kinds, allowed) in _CLASSES.items():
        count = sum(collision.at_fault and collision.kind in kinds for collision in met)
        value *= max(0.0, 1.0 - count / (allowed + 1))
        parts[name] = float(count)
    return Metric(name="no_ego_at_fault_collisions", value=value, parts=parts)


def outside_m(drive: Drive) -> FloatArray:
    """Return how far the ego's furthest corner is outside the drivable area, (T,)."""
    return np.asarray(drive.road.drivable.distance_m(corners(drive.boxes)).max(axis=1))


def drivable_area(drive: Drive) -> Metric:
    """0 if a corner is ever 0.3 m or more outside."""
    furthest = float(outside_m(drive).max())
    value, parts = float(furthest < OFF_ROAD_M), {"furthest_outside_m": furthest}
    return Metric(name="drivable_area_compliance", value=value, parts=parts)


def time_to_collision(drive: Drive, met: tuple[Collision, ...]) -> Metric:
    """1 if every moment's time to collision is above 0.95 s."""
    lowest = float(ttc_series(drive, met, only_relevant=True).min())
    if any(collision.at_fault for collision in met):
        lowest = 0.0
    return Metric(
        name="time_to_collision_within_bound",
        value=float(lowest > LEAST_TTC_S),
        weight=5.0,
        parts={"lowest_s": min(lowest, TTC_HORIZON_S)},
    )


def ttc_series(drive: Drive, met: tuple[Collision, ...], *, only_relevant: bool) -> FloatArray:
    """Return the time (T,) after which ego and somebody meet if both go on; inf for never.

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
        kept = np.array([first.get(name, moment + 1) > moment for name in objects.ids])
        if only_relevant:
            angle = bearings(state[None], objects.boxes[:, :2])
            kept &= (angle < AHEAD_RAD) | (loose[moment] & (angle <= BEHIND_RAD))
        times[moment] = _first_meeting(drive.boxes[moment], state, objects.chosen(kept))
    return times


def _first_meeting(box: FloatArray, state: FloatArray, objects: Objects) -> float:
    """The first of 0.1, 0.2 ... 2.9 s at which the ego's box meets one of the objects."""
    times = np.arange(1, round(TTC_HORIZON_S / STEP_S)) * STEP_S
    fastest = abs(state[SPEED]) + np.abs(objects.speeds_mps)
    reach = radii(objects.boxes) + radii(box) + times[-1] * fastest
    near = ((objects.boxes[:, :2] - box[:2]) ** 2).sum(axis=1) <= reach**2
    theirs = objects.chosen(near).later(times)
    mine = np.broadcast_to(box, theirs.shape).copy()
    mine[..., :3] = moved_ahead(mine, (times * state[SPEED])[:, None])
    hit = meet(mine, theirs).any(axis=1)
    return float(times[hit.argmax()]) if hit.any() else float("inf")


def allows_detour(scenario_type: ScenarioType | None) -> bool:
    """Return whether the other direction's lane may be used: direction is then a weight of 1."""
    return scenario_type in _DETOUR


def passed_obstacles(drive: Drive, expert: Expert, modification: Modification | None) -> Metric:
    """1 if the ego's share of the expert's way reaches beyond the furthest obstacle's.

    Obstacles are standing vehicles, cones, and where walks end.
    """
    places = []
    for agent in () if modification is None else modification.changed:
        is_standing = agent.type in (AgentType.VEHICLE, AgentType.BUS) and agent.speed_mps <= 0.0
        if agent.walk_to_m is not None:
            places.append(agent.walk_to_m)
        elif is_standing or agent.type is AgentType.TRAFFIC_CONE:
            places.append((agent.x_m, agent.y_m))
    ratio, wanted = progress_ratio(drive, expert), 0.0
    if places and expert.progress_m > 0.0:
        stations, _ = drive.road.centreline.beside(np.array(places))
        along = np.clip(stations - expert.start_m, 0.0, expert.progress_m)
        wanted = float(along.max()) / expert.progress_m
    parts = {"ratio": ratio, "wanted_ratio": wanted}
    return Metric(name="ego_passed_obstacles", value=float(ratio >= wanted), parts=parts)


def lane_changes_to_goal(drive: Drive, ways: IntArray) -> Metric:
    """1 if the drive ends on the route, 0.5 elsewhere; our goals never need a lane change."""
    on_start, on_end = (
        way >= 0 and drive.road.names[way] in drive.road.route for way in ways[[0, -1]]
    )
    value = NO_START if not on_start else 1.0 if on_end else OFF_GOAL_LANE
    return Metric(name="lane_changes_to_goal", value=value, weight=4.0)
