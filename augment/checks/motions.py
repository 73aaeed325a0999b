"""Feasibility of motions as planned, before the ego comes; no intent needed.

Everybody is where `find_motion` has them: the ego as it was recorded, or at the speed of t0.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from augment.checks.bodies import FAR_OFF, GRAZED_M, RIDERS, name_type
from augment.checks.finding import Finding, FindingKind, Severity, find
from augment.checks.ground import ChangedScene
from augment.checks.places import name_stray, stray
from augment.geometry import frames
from augment.geometry.frames import Box, Pose
from augment.geometry.polyline import FloatArray
from augment.scene.entities import STOPPED_BELOW_MPS, AgentType
from augment.scene.motion import STEP_S, MotionSource, Movement
from augment.scene.planned_motion import EGO_ID, AtPlace, AtTime

COMES_WITHIN_M = 15.0
"""The ego comes to whom it gets this near; what happens after the nearest moment depends on it."""
FRICTION_MPS2 = 9.81
"""Tyres hold about their own weight on dry asphalt."""
WINDOW_S = 0.5
"""Brakes and drivers take so long; a jump of speed is spread over it."""
BEND_S, BEND_M = 0.25, 1.5
"""A bend is measured over so much before and after, whichever is longer: maps have corners."""
TURNED_DEG, SPUN_DEG = 15.0, 45.0
STRAY_STEPS = 5
"""Every so many steps it is looked at whether an agent is on its ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLimits:
    """Limits of a class's motion; m/s^2, and the radius in m of its centre's path."""

    speeding_up: float
    braking: float
    sideways: float
    radius_m: float


LIMITS = {
    AgentType.VEHICLE: MotionLimits(speeding_up=5.0, braking=9.0, sideways=7.0, radius_m=4.2),
    AgentType.BUS: MotionLimits(speeding_up=2.5, braking=7.0, sideways=4.0, radius_m=8.0),
    AgentType.BICYCLE: MotionLimits(speeding_up=3.0, braking=6.0, sideways=5.0, radius_m=1.5),
}
"""Cars: 0 to 100 km/h in 5.5 s, UN R13-H demands 6.4 m/s^2, turning circles are 11 m wide at
the outer wheel, 8.4 m at the centre.
Buses: R13 demands 5 m/s^2, they roll over from 5 on, R107 has them turn within 12.5 m. Riders
fall over the handlebar from 6 on. People and things turn and stop as they like."""


def motion_trigger(situation: ChangedScene) -> Iterator[Finding]:
    """When each motion begins: doubtful if never, but a fact where only an assumed ego decides."""
    for mover in situation.planned.values():
        assert mover.agent.motion is not None
        ego, start = situation.motion.ego, mover.agent.motion.start
        first = _first_step(situation, mover)
        if mover.started_s is not None and first is not None:
            yield find(
                FindingKind.MOTION_TRIGGER,
                Severity.FACT,
                [mover.agent],
                "The motion of {agents[0]} begins after {after_s:.1f} s, {ego_m:.1f} m from the "
                "ego.",
                after_s=mover.started_s,
                ego_m=float(_apart_m(mover, ego)[first]),
            )
            continue
        by_ego = not isinstance(start, AtTime) and (
            not isinstance(start, AtPlace) or start.agent_id == EGO_ID
        )
        is_assumed = by_ego and ego.source is not MotionSource.RECORDED
        words = ", if the ego holds its speed" if is_assumed else ""
        yield find(
            FindingKind.MOTION_TRIGGER,
            Severity.FACT if is_assumed else Severity.DOUBTFUL,
            [mover.agent],
            f"The motion of {{agents[0]}} does not begin within {{within_s:.1f}} s{words}.",
            within_s=float(situation.motion.times_s[-1]),
        )


def motion_start(situation: ChangedScene) -> Iterator[Finding]:
    """Vehicles and bicycles that turn on the spot as their motion begins.

    Doubtful above 15 degrees, wrong above 45.
    """
    for mover in situation.planned.values():
        first = _first_step(situation, mover)
        if mover.agent.type not in LIMITS or first is None:
            continue
        before_rad = mover.states[first - 1, 2] if first else mover.agent.heading_rad
        turn_deg = float(np.degrees(frames.wrap(mover.states[first, 2] - before_rad)))
        if abs(turn_deg) > TURNED_DEG:
            yield find(
                FindingKind.MOTION_START,
                Severity.WRONG if abs(turn_deg) > SPUN_DEG else Severity.DOUBTFUL,
                [mover.agent],
                "{agents[0]} turns on the spot by {turn_deg:.0f} degrees to the left as its "
                "motion begins.",
                turn_deg=turn_deg,
            )


def motion_limits(situation: ChangedScene) -> Iterator[Finding]:
    """Accelerations along and across the way and the tightest bend against what a kind manages.

    Together they bound the yaw rate. Doubtful above the limits of `LIMITS`; wrong above what
    friction holds, and for a radius by the factor `FAR_OFF` below.
    """
    for mover in situation.planned.values():
        limits, first = LIMITS.get(mover.agent.type), _first_step(situation, mover)
        if limits is None or first is None:
            continue
        window = min(round(WINDOW_S / STEP_S), len(mover.states) - 1)
        # (T - window,) mean accelerations in m/s^2.
        gained = (mover.states[window:, 3] - mover.states[:-window, 3]) / (window * STEP_S)
        sideways, curvature = measure_bends(mover.states[first:])
        kind = name_type(mover.agent.type)
        for words, most, limit in (
            ("speeds up by", np.nanmax(gained, initial=0.0), limits.speeding_up),
            ("brakes by", -np.nanmin(gained, initial=0.0), limits.braking),
            ("is pulled sideways by", sideways, limits.sideways),
        ):
            if most > limit * 1.001:
                yield find(
                    FindingKind.MOTION_LIMITS,
                    Severity.WRONG if most > FRICTION_MPS2 * 1.001 else Severity.DOUBTFUL,
                    [mover.agent],
                    f"{{agents[0]}} {words} {{most_mps2:.1f}} m/s^2; {kind} manages {limit:.1f}.",
                    most_mps2=float(most),
                )
        if curvature > 1.0 / limits.radius_m:
            yield find(
                FindingKind.MOTION_LIMITS,
                Severity.WRONG if curvature > FAR_OFF / limits.radius_m else Severity.DOUBTFUL,
                [mover.agent],
                f"{{agents[0]}} turns on a radius of {{radius_m:.1f}} m; {kind} needs "
                f"{limits.radius_m:.1f} m.",
                radius_m=1.0 / curvature,
            )


def motion_off_road(situation: ChangedScene) -> Iterator[Finding]:
    """Find motions that leave the ground of their class, by `off_road`'s limits; worst place.

    Only what is worse than at t0. Who leaves the map does so nose first, which is no fault.
    """
    ground = situation.ground
    for mover in () if ground.road.is_empty else situation.planned.values():
        agent, box = mover.agent, situation.boxes[mover.agent.id]
        there = mover.states[mover.is_present]
        steps = list(range(0, len(there), STRAY_STEPS))
        if len(there) < len(mover.states):
            # (T,) metres to where it leaves the map; within its length the nose is past the edge.
            left_m = np.hypot(*(there[:, :2] - there[-1, :2]).T)
            steps = [step for step in steps if left_m[step] > agent.length_m]
        strays = [(stray(ground, agent.type, box_at(box, there[step])), step) for step in steps]
        worst, step = max(
            strays, key=lambda entry: (entry[0].over, entry[0].off), default=(None, 0)
        )
        if worst is None or worst.over < 2 or worst.over <= stray(ground, agent.type, box).over:
            continue
        yield find(
            FindingKind.MOTION_OFF_ROAD,
            worst.severity,
            [agent],
            f"After {{after_s:.1f}} s, {name_stray(agent.type)}",
            after_s=float(situation.motion.times_s[step]),
            outside_share=worst.outside_share,
            gap_m=worst.gap_m,
        )


def motion_blocked(situation: ChangedScene) -> Iterator[Finding]:
    """Contacts with others before the ego comes, by the first moment.

    Wrong with who stands or has a motion too, doubtful with who else moves, as they may yield.
    People step aside from each other. Who touches from t0 on, as a door its car, does not count
    until they have parted.
    """
    for mover in situation.planned.values():
        until = _ego_comes(situation, mover)
        for other in situation.motion.others:
            is_second = other.agent.id in situation.planned and other.agent.id <= mover.agent.id
            if is_second or {mover.agent.type, other.agent.type} <= RIDERS:
                continue
            step = _contact(mover, other, until)
            if step is None:
                continue
            yields = other.states[step, 3] >= STOPPED_BELOW_MPS
            yields = yields and other.source is not MotionSource.PLANNED
            yield find(
                FindingKind.MOTION_BLOCKED,
                Severity.DOUBTFUL if yields else Severity.WRONG,
                [mover.agent, other.agent],
                "{agents[0]} and {agents[1]} collide after {after_s:.1f} s, before the ego comes.",
                after_s=float(situation.motion.times_s[step]),
            )


# Private


def _apart_m(movement: Movement, other: Movement) -> FloatArray:
    return np.asarray(np.hypot(*(movement.states[:, :2] - other.states[:, :2]).T))


def _first_step(situation: ChangedScene, mover: Movement) -> int | None:
    """The first step at which a motion is carried out, None where it is not or leaves the map."""
    if mover.started_s is None:
        return None
    # 1e-9 s, as a start may fall on a step but for rounding.
    first = int(np.searchsorted(situation.motion.times_s, mover.started_s - 1e-9))
    return first if first < len(mover.states) and mover.is_present[first] else None


def measure_bends(states: FloatArray) -> tuple[float, float]:
    """The most that one is pulled sideways (m/s^2), and the largest curvature (1/m).

    Of the circles through three places of the way: here, and as far before as behind.
    """
    states = states[~np.isnan(states).any(axis=1)]
    steps_m = np.hypot(*np.diff(states[:, :2], axis=0).T)
    states = states[np.concatenate([[True], steps_m > 1e-6])]
    gone_m = np.concatenate([[0.0], np.cumsum(steps_m[steps_m > 1e-6])])
    reach_m = np.maximum(BEND_M, BEND_S * states[:, 3])
    # Of each place the last one a reach before it, and the first one a reach after it.
    before = np.searchsorted(gone_m, gone_m - reach_m + 1e-9, side="right") - 1
    after = np.searchsorted(gone_m, gone_m + reach_m - 1e-9)
    inside = (before >= 0) & (after < len(gone_m))
    if not inside.any():
        return 0.0, 0.0
    a, b, c = (states[at, :2] for at in (before[inside], inside, after[inside]))
    ab, bc, ca = b - a, c - b, a - c
    # 1 / r = 4 area / (|ab| |bc| |ca|) of the circle through three points; this is twice the area.
    area2 = np.abs(ab[:, 0] * bc[:, 1] - ab[:, 1] * bc[:, 0])
    sides = np.prod([np.hypot(*side.T) for side in (ab, bc, ca)], axis=0)
    curvature = 2.0 * area2 / np.maximum(sides, 1e-9)
    return float((curvature * states[inside, 3] ** 2).max()), float(curvature.max())


def box_at(box: Box, state: FloatArray) -> Box:
    """Return a box moved to a state of its movement."""
    x_m, y_m, heading_rad, _ = state.tolist()
    return replace(box, pose=Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))


def _ego_comes(situation: ChangedScene, mover: Movement) -> int:
    """The step at which the ego is nearest, the last one if it never comes near."""
    # (T,), NaN while one of the two is not there.
    apart_m = _apart_m(mover, situation.motion.ego)
    nearest = int(np.nanargmin(apart_m))
    return nearest if nearest and apart_m[nearest] <= COMES_WITHIN_M else len(apart_m) - 1


def _contact(movement: Movement, other: Movement, until: int) -> int | None:
    """The first step at which two boxes share ground, but for a contact that lasts since t0."""
    reach_m = (
        sum(np.hypot(way.agent.length_m, way.agent.width_m) for way in (movement, other)) / 2.0
    )
    # Circles round both boxes first: few steps are left to be measured.
    near, parted = _apart_m(movement, other)[: until + 1] < reach_m, False
    for step, is_near in enumerate(near.tolist()):
        # Passing corners is no contact.
        touches = is_near and _depth_m(movement, other, step) > GRAZED_M
        if touches and parted:
            return step
        parted = parted or not touches
    return None


def _depth_m(movement: Movement, other: Movement, step: int) -> float:
    boxes = (box_at(way.agent.box, way.states[step]) for way in (movement, other))
    return frames.overlap(*boxes).depth_m
