"""The parts of a driving score: nuPlan's, and what interPlan's score adds."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from augment.scene.entities import AgentType, Modification, ScenarioType, TrafficAgent
from augment.simulation.drive import Drive, Expert
from augment.simulation.road import Road
from augment.simulation.states import (
    AHEAD_RAD,
    BEHIND_RAD,
    HEADING,
    SPEED,
    STEP_S,
    BoolArray,
    Contact,
    FloatArray,
    IntArray,
    Kind,
    Objects,
    at_fault,
    bearings,
    classify,
    corners,
    meet,
    radii,
    wrap_angles,
)

NO_WAY = -1
NEAR_M = 5.0
"""So far off every way the ego still counts as on the one it was on."""


def ego_ways(road: Road, centres_m: FloatArray, headings_rad: FloatArray) -> IntArray:
    """The index of the way at each moment (T,), `NO_WAY` off them all.

    The way stays the one it was while that contains the centre. Else one of the ways there is
    taken: one that follows the old way, then one of the route, then the best aligned.
    """
    inside = road.covering(centres_m)
    ways = np.full(len(centres_m), NO_WAY, dtype=np.int64)
    before = NO_WAY
    for moment, row in enumerate(inside):
        candidates = np.flatnonzero(row)
        if before != NO_WAY and row[before]:
            ways[moment] = before
        elif len(candidates):
            heading = float(headings_rad[moment])
            ways[moment] = _pick(road, candidates, before, centres_m[moment], heading)
        elif before != NO_WAY and _near(road, before, centres_m[moment]):
            ways[moment] = before
        before = int(ways[moment])
    return ways


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """The first contact with one object."""

    moment: int
    object_id: str
    kind: Kind
    contact: Contact
    at_fault: bool


def collisions(drive: Drive) -> tuple[Collision, ...]:
    """Who was touched, in the order of time.

    Who touches the ego at the very start is left out: nobody drove there.
    """
    met: list[Collision] = []
    known: set[str] = set()
    astray = off_one_way(drive)
    for moment, objects in enumerate(drive.objects):
        box = np.broadcast_to(drive.boxes[moment], objects.boxes.shape)
        hit = [n for n in np.flatnonzero(meet(box, objects.boxes)) if objects.ids[n] not in known]
        known |= {objects.ids[number] for number in hit}
        if not hit or moment == 0:
            continue
        states = np.repeat(drive.states[moment : moment + 1], len(hit), axis=0)
        contacts = classify(
            states,
            states[:, SPEED],
            objects.boxes[hit],
            objects.speeds_mps[hit],
            objects.kinds[hit],
            drive.body,
        )
        guilty = at_fault(contacts, np.full(len(hit), astray[moment]))
        for number, contact, fault in zip(hit, contacts, guilty, strict=True):
            met.append(
                Collision(
                    moment=moment,
                    object_id=objects.ids[number],
                    kind=Kind(int(objects.kinds[number])),
                    contact=Contact(int(contact)),
                    at_fault=bool(fault),
                )
            )
    return tuple(met)


def off_one_way(drive: Drive) -> BoolArray:
    """Whether the ego is off the road, or not on one way and what follows it, (T,)."""
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
        series: What it looked at, by name: (T,) each.
    """

    name: str
    value: float | None
    weight: float | None = None
    parts: dict[str, float] = field(default_factory=dict)
    series: dict[str, FloatArray] = field(default_factory=dict)


def combine(metrics: tuple[Metric, ...]) -> float:
    """The product of the multipliers times the weighted mean of the others, 0 to 1."""
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


LITTLE_M = 2.0
ENOUGH_PROGRESS = 0.2
DIRECTION_STEPS = 11
WRONG_WAY_FREE_M, WRONG_WAY_HALF_M = 2.0, 6.0
MAX_OVERSPEED_MPS = 2.23


def progress_ratio(drive: Drive, expert: Expert) -> float:
    """The ego's advance as a share of the expert's, 0 to 1; both count as 2 m at least."""
    stations, _ = drive.road.centreline.beside(drive.boxes[[0, -1], :2])
    advance = float(stations[1] - stations[0])
    if advance < -LITTLE_M:
        return 0.0
    return min(1.0, max(advance, LITTLE_M) / max(expert.progress_m, LITTLE_M))


def progress(drive: Drive, expert: Expert) -> Metric:
    """How far the ego came, measured by the expert."""
    stations, _ = drive.road.centreline.beside(drive.boxes[:, :2])
    return Metric(
        name="ego_progress_along_expert_route",
        value=progress_ratio(drive, expert),
        weight=5.0,
        parts={"ego_m": float(stations[-1] - stations[0]), "expert_m": expert.progress_m},
        series={"advance_m": stations - stations[0]},
    )


def making_progress(drive: Drive, expert: Expert) -> Metric:
    """1 from a ratio of 0.2 on."""
    ratio = progress_ratio(drive, expert)
    return Metric(
        name="ego_is_making_progress",
        value=float(ratio >= ENOUGH_PROGRESS),
        parts={"ratio": ratio},
    )


def direction(drive: Drive, ways: IntArray, *, weight: float | None = None) -> Metric:
    """By the longest way against the lane's direction in 1.1 s: < 2 m is 1, < 6 m 0.5, else 0.

    The first two moments on another way count nothing.
    """
    centres = drive.boxes[:, :2]
    steps = np.zeros(len(centres))
    fresh = 2
    for moment in range(1, len(centres)):
        fresh = fresh + 1 if ways[moment] == ways[moment - 1] else 0
        if ways[moment] == NO_WAY or fresh < 2:
            continue
        path = drive.road.way_path(int(ways[moment]))
        (before, here), _ = path.beside(centres[moment - 1 : moment + 1])
        steps[moment] = here - before
    window = np.convolve(steps, np.ones(DIRECTION_STEPS))[: len(steps)]
    against = max(0.0, -float(window.min()))
    half = 0.5 if against < WRONG_WAY_HALF_M else 0.0
    value = 1.0 if against < WRONG_WAY_FREE_M else half
    return Metric(
        name="driving_direction_compliance",
        value=value,
        weight=weight,
        parts={"against_m": against},
        series={"advance_in_1_1_s_m": window},
    )


def speed_limit(drive: Drive, ways: IntArray) -> Metric:
    """1 less the overspeed, integrated and held against 2.23 m/s throughout."""
    limits = np.append(drive.road.limits_mps, np.nan)[ways]
    over = np.nan_to_num(np.maximum(drive.states[:, SPEED] - limits, 0.0))
    value = None
    duration_s = max(drive.duration_s, STEP_S)
    if not np.isnan(limits).all():
        value = max(0.0, 1.0 - float(over.sum()) * STEP_S / (MAX_OVERSPEED_MPS * duration_s))
    return Metric(
        name="speed_limit_compliance",
        value=value,
        weight=4.0,
        parts={"most_over_mps": float(over.max())},
        series={"over_mps": over},
    )


def red_lights(drive: Drive) -> Metric:
    """0 if the ego's front ever crosses a red stop line. Not nuPlan's; off unless asked for."""
    stations, _ = drive.road.centreline.beside(drive.boxes[:, :2])
    front = stations + drive.body.length_m / 2.0
    red = drive.road.red_stations_m
    crossed = ((front[:-1, None] < red) & (front[1:, None] >= red)).any(axis=1)
    return Metric(
        name="red_light_compliance",
        value=float(not crossed.any()),
        parts={"crossed": float(crossed.sum())},
        series={"crossed": np.append(0.0, crossed.astype(np.float64))},
    )


OFF_ROAD_M = 0.3
LEAST_TTC_S = 0.95
TTC_HORIZON_S = 3.0
STILL_MPS = 5e-3
_ALLOWED = {Kind.VEHICLE: 0, Kind.PEDESTRIAN: 0, Kind.BICYCLE: 0, Kind.STATIC: 1}
_CLASSES = {
    "vulnerable_road_users": (Kind.PEDESTRIAN, Kind.BICYCLE),
    "vehicles": (Kind.VEHICLE,),
    "things": (Kind.STATIC,),
}


def no_fault_collisions(drive: Drive, met: tuple[Collision, ...]) -> Metric:
    """The product over the classes of max(0, 1 - collisions / (allowed + 1))."""
    value, parts = 1.0, {"not_at_fault": float(sum(not collision.at_fault for collision in met))}
    for name, kinds in _CLASSES.items():
        count = sum(collision.at_fault and collision.kind in kinds for collision in met)
        value *= max(0.0, 1.0 - count / (_ALLOWED[kinds[0]] + 1))
        parts[name] = float(count)
    happened = np.zeros(len(drive.states))
    for collision in met:
        happened[collision.moment] += 1.0 if collision.at_fault else 0.5
    return Metric(
        name="no_ego_at_fault_collisions", value=value, parts=parts, series={"contact": happened}
    )


def drivable_area(drive: Drive) -> Metric:
    """0 if a corner is ever 0.3 m or more outside."""
    places = corners(drive.boxes)
    off = np.zeros(places.shape[:2])
    outside = ~drive.road.drivable.contains(places)
    if outside.any():
        off[outside] = drive.road.drivable.distance_m(places[outside])
    furthest = off.max(axis=1)
    return Metric(
        name="drivable_area_compliance",
        value=float(furthest.max() < OFF_ROAD_M),
        parts={"furthest_outside_m": float(furthest.max())},
        series={"outside_m": furthest},
    )


def time_to_collision(drive: Drive, met: tuple[Collision, ...]) -> Metric:
    """1 if every moment's time to collision is above 0.95 s."""
    series = ttc_series(drive, met, only_relevant=True)
    for collision in met:
        if collision.at_fault:
            series[collision.moment] = 0.0
    lowest = float(series.min())
    return Metric(
        name="time_to_collision_within_bound",
        value=float(lowest > LEAST_TTC_S),
        weight=5.0,
        parts={"lowest_s": min(lowest, TTC_HORIZON_S)},
        series={"ttc_s": np.minimum(series, TTC_HORIZON_S)},
    )


def ttc_series(drive: Drive, met: tuple[Collision, ...], *, only_relevant: bool) -> FloatArray:
    """The time (T,) after which ego and somebody meet if both go on as they do; inf for never.

    Args:
        drive: What happened.
        met: Its collisions; who was met already is left out from then on.
        only_relevant: Only who is ahead, or beside an ego that is not on one way or in an
            intersection, as nuPlan has it.
    """
    first = {collision.object_id: collision.moment for collision in met}
    times = np.full(len(drive.states), np.inf)
    centres = drive.boxes[:, :2]
    loose = off_one_way(drive) | drive.road.intersections.contains(centres)
    for moment, objects in enumerate(drive.objects):
        state = drive.states[moment]
        if state[SPEED] <= STILL_MPS or not len(objects):
            continue
        kept = np.array([first.get(name, moment + 1) > moment for name in objects.ids])
        if only_relevant:
            kept &= _relevant(state, objects, bool(loose[moment]))
        if kept.any():
            times[moment] = _first_meeting(drive.boxes[moment], state, objects.chosen(kept))
    return times


def _relevant(state: FloatArray, objects: Objects, loose: bool) -> BoolArray:
    angle = bearings(np.broadcast_to(state, (len(objects), len(state))), objects.boxes[:, :2])
    return np.asarray((angle < AHEAD_RAD) | (loose & (angle <= BEHIND_RAD)), dtype=np.bool_)


def _first_meeting(box: FloatArray, state: FloatArray, objects: Objects) -> float:
    """The first of 0.1, 0.2 ... 2.9 s at which the ego's box meets one of the objects."""
    times = np.arange(1, round(TTC_HORIZON_S / STEP_S)) * STEP_S
    reach = (
        radii(objects.boxes)
        + radii(box)
        + times[-1] * (abs(state[SPEED]) + np.abs(objects.speeds_mps))
    )
    near = ((objects.boxes[:, :2] - box[:2]) ** 2).sum(axis=1) <= reach**2
    if not near.any():
        return float("inf")
    objects = objects.chosen(near)
    mine = np.broadcast_to(box, (len(times), 1, 5)).copy()
    mine[:, 0, 0] += times * state[SPEED] * np.cos(state[HEADING])
    mine[:, 0, 1] += times * state[SPEED] * np.sin(state[HEADING])
    theirs = np.broadcast_to(objects.boxes, (len(times), len(objects), 5)).copy()
    heading = objects.boxes[:, 2]
    theirs[..., 0] += times[:, None] * objects.speeds_mps * np.cos(heading)
    theirs[..., 1] += times[:, None] * objects.speeds_mps * np.sin(heading)
    hit = meet(np.broadcast_to(mine, theirs.shape), theirs).any(axis=1)
    return float(times[hit.argmax()]) if hit.any() else float("inf")


OFF_GOAL_LANE = 0.5
NO_START = 0.2607
_DETOUR = (
    ScenarioType.CONSTRUCTION_ZONE,
    ScenarioType.ACCIDENT_SITE,
    ScenarioType.NUDGE,
    ScenarioType.OVERTAKE,
)


def allows_detour(scenario_type: ScenarioType | None) -> bool:
    """Whether the other direction's lane may be used: direction is then a weight of 1."""
    return scenario_type in _DETOUR


def passed_obstacles(drive: Drive, expert: Expert, modification: Modification | None) -> Metric:
    """1 if the ego's share of the expert's way reaches beyond the furthest obstacle's."""
    places = _obstacles(modification)
    ratio = progress_ratio(drive, expert)
    wanted = 0.0
    if places and expert.progress_m > 0.0:
        stations, _ = drive.road.centreline.beside(np.array(places))
        along = np.clip(stations - expert.start_m, 0.0, expert.progress_m)
        wanted = float(along.max()) / expert.progress_m
    return Metric(
        name="ego_passed_obstacles",
        value=float(ratio >= wanted),
        parts={"ratio": ratio, "wanted_ratio": wanted},
    )


def lane_changes_to_goal(drive: Drive, ways: IntArray) -> Metric:
    """1 if the drive ends on the route, 0.5 elsewhere; our goals never need a lane change."""
    on_start, on_end = (_on_route(drive, int(way)) for way in ways[[0, -1]])
    value = NO_START if not on_start else 1.0 if on_end else OFF_GOAL_LANE
    return Metric(name="lane_changes_to_goal", value=value, weight=4.0)


def _on_route(drive: Drive, way: int) -> bool:
    return way >= 0 and drive.road.names[way] in drive.road.route


def _obstacles(modification: Modification | None) -> list[tuple[float, float]]:
    """Standing vehicles, cones, and where walks end."""
    changed = () if modification is None else modification.changed
    places = []
    for agent in changed:
        if agent.walk_to_m is not None:
            places.append(agent.walk_to_m)
        elif _stands(agent):
            places.append((agent.x_m, agent.y_m))
    return places


def _stands(agent: TrafficAgent) -> bool:
    vehicle = agent.type in (AgentType.VEHICLE, AgentType.BUS) and agent.speed_mps <= 0.0
    return vehicle or agent.type is AgentType.TRAFFIC_CONE
