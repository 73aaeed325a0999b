"""The score's safety metrics: collisions, the drivable area, time to collision."""

from __future__ import annotations

import numpy as np

from augment.simulation.contact import AHEAD_RAD, BEHIND_RAD, bearings
from augment.simulation.drive import Drive
from augment.simulation.encounters import Collision, off_one_way
from augment.simulation.metric import Metric
from augment.simulation.objects import Kind, Objects
from augment.simulation.overlap import corners, meet, radii
from augment.simulation.states import HEADING, SPEED, STEP_S, BoolArray, FloatArray

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
    value, parts = 1.0, {"not_at_fault": float(sum(not one.at_fault for one in met))}
    for name, kinds in _CLASSES.items():
        count = sum(one.at_fault and one.kind in kinds for one in met)
        value *= max(0.0, 1.0 - count / (_ALLOWED[kinds[0]] + 1))
        parts[name] = float(count)
    happened = np.zeros(len(drive.states))
    for one in met:
        happened[one.moment] += 1.0 if one.at_fault else 0.5
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
    for one in met:
        if one.at_fault:
            series[one.moment] = 0.0
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
    first = {one.object_id: one.moment for one in met}
    made = np.full(len(drive.states), np.inf)
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
            made[moment] = _first_meeting(drive.boxes[moment], state, objects.chosen(kept))
    return made


# Private


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
