"""Motions of agents after t0 against the motion that was asked for."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise, takewhile

import numpy as np

from augment.checks.finding import Finding, FindingKind, find
from augment.checks.lanes_across import find_mark
from augment.checks.parties import MARK_M, Bounds, Case, apart_m, hold, motion_bounds
from augment.geometry.frames import difference
from augment.scene import planned_motion as planned
from augment.scene.entities import TrafficAgent
from augment.scene.intent import MotionWish, Side, Spot, StartWish
from augment.scene.motion import STEP_S, FloatArray
from augment.scene.planned_mover import walk_as_motion
from augment.scene.presets import find_bend_end

# Since its start.
_CARRIED_OUT_S = 15.0
_THERE_M = 0.3
"""So near to where a lane change ends it is over."""
BRAKES = Bounds(3.0, math.inf, 0.0)
"""Hard braking where no number is said, in m/s^2."""
_TURNS_ROUND = Bounds(180.0, 180.0, 20.0)
SLOWS = planned.MotionPreset.HARD_BRAKING, planned.MotionPreset.EMERGENCY_STOP
DOOR = Bounds(0.5, 1.2, 0.3)
"""How far a door opens, in metres."""


def check_course(case: Case) -> Iterator[Finding]:
    """Check who is to stay, and the requested motion: its start, its course and its numbers."""
    before = {agent.id: agent for agent in case.route.scene.agents}
    for party in case.parties:
        wish: MotionWish | None = getattr(party.request, "motion", None)
        for agent in map(walk_as_motion, party.agents):
            if agent.id in before and party.request.spot == Spot():
                off_m, wanted = apart_m(agent, before[agent.id]), case.tolerances.distance_m
                words = f"{{agents[0]}} is {off_m:.2f} m from where it was and is to stay."
                yield find(FindingKind.ASKED_DISTANCE, off_m <= wanted, [agent], words, off=off_m)
            if wish is None:
                continue
            # Who drives goes on as its scene has it.
            motion = agent.motion or (planned.PlannedMotion() if agent.speed_mps > 0.0 else None)
            if motion is None:
                words = f"{{agents[0]}} has no motion; asked for: {wish.preset.label.lower()}."
                yield find(FindingKind.ASKED_MOTION, False, [agent], words)
                continue
            if wish.start is not None:
                yield from _start(case, agent, motion, wish)
            states = _carry_out(case, agent, motion)
            if not len(states):
                words = "{agents[0]} has left the map before its motion begins."
                yield find(FindingKind.ASKED_MOTION, False, [agent], words)
                continue
            yield from check_path(case, agent, wish, states)
            yield from _numbers(case, agent, motion, wish, states)


# Private


def _start(
    case: Case, agent: TrafficAgent, motion: planned.PlannedMotion, asked: MotionWish
) -> Iterator[Finding]:
    start, kind, wish = motion.start, FindingKind.ASKED_START, asked.start or StartWish()
    if wish.after_s is not None and isinstance(start, planned.AtTime):
        wanted = motion_bounds("after_s", wish.after_s.low, wish.after_s.high)
        what, value_s = "The start of {agents[0]}", start.after_s
        ends_s = value_s + (motion.speeds[-1][0] if motion.speeds else 0.0)
        if asked.preset in SLOWS or agent.is_stopped:
            # Who holds its speed at first has not begun.
            same = takewhile(lambda pair: pair[1] == agent.speed_mps, motion.speeds)
            value_s += max((after_s for after_s, _ in same), default=0.0)
        if wish.may_end and wanted.off(ends_s) < wanted.off(value_s):
            what, value_s = "The end of the motion of {agents[0]}", ends_s
        yield hold(kind, [agent], what, value_s, wanted, unit="s")
        return
    is_at_mark = isinstance(start, planned.AtPlace) and start.agent_id == planned.EGO_ID
    if wish.after_s is None and (is_at_mark if wish.mark else isinstance(start, planned.NearEgo)):
        assert not isinstance(start, planned.AtTime)
        mark_m = find_mark(case.lanes, wish.mark) if wish.mark else None
        if mark_m is not None and isinstance(start, planned.AtPlace):
            off_m = case.route.locate(start.x_m, start.y_m).ahead_m - mark_m
            what = f"How far past the {wish.mark} the ego is waited for by {{agents[0]}}"
            yield hold(kind, [agent], what, off_m, Bounds(0.0, 0.0, MARK_M))
        near = wish.ego_distance
        ends_m = near.span_m if near else (planned.REACHED_M, planned.REACHED_M)
        what = "The ego's distance at the start of {agents[0]}"
        wanted = motion_bounds("within_m", *ends_m)
        yield hold(kind, [agent], what, start.within_m, wanted)
        return
    words = f"{{agents[0]}} is to begin {wish}; its start is of another kind."
    yield find(kind, False, [agent], words)


def _carry_out(case: Case, agent: TrafficAgent, motion: planned.PlannedMotion) -> FloatArray:
    """States (T, 4) of the motion alone, from its start on; only its own seconds are waited."""
    begins = motion.start if isinstance(motion.start, planned.AtTime) else planned.AtTime()
    alone = agent.motion and replace(agent, motion=replace(motion, start=begins))
    times_s = np.arange(begins.after_s, begins.after_s + _CARRIED_OUT_S, STEP_S).tolist()
    # (T, 4), without the steps past the map.
    states = case.carry_out(alone or agent, times_s)
    return states[~np.isnan(states[:, 0])]


def check_path(
    case: Case, agent: TrafficAgent, wish: MotionWish, states: FloatArray
) -> Iterator[Finding]:
    """Check the place that the motion reaches."""
    places = [case.route.locate(x, y) for x, y in states[:, :2].tolist()]
    first, last = places[0], places[-1]
    match wish.preset:
        case planned.MotionPreset.CUT_IN | planned.MotionPreset.PULL_OUT:
            what = "The offset of {agents[0]} in the end to the left of the ego's lane's centre"
            wanted = Bounds(0.0, 0.0, case.tolerances.middle_m)
            yield hold(FindingKind.ASKED_ACROSS, [agent], what, last.left_m, wanted)
        case planned.MotionPreset.U_TURN:
            turned_deg = math.degrees(abs(difference(states[-1, 2], states[0, 2])))
            what, kind = "The turn of {agents[0]} in the end", FindingKind.ASKED_HEADING
            yield hold(kind, [agent], what, turned_deg, _TURNS_ROUND, unit="degrees")
        case planned.MotionPreset.LATE_PEDESTRIAN | planned.MotionPreset.RED_LIGHT:
            words = "{agents[0]} is to cross the ego's way ahead of it"
            # Between two steps on different sides of the ego's way, it was on it.
            meets = (b.ahead_m for a, b in pairwise(places) if a.left_m * b.left_m <= 0.0)
            crosses = max(meets, default=0.0) > 0.0 and first.left_m * last.left_m < 0.0
            yield find(FindingKind.ASKED_CROSSING, crosses, [agent], f"{words}.")
            if wish.side is not None and crosses:
                fits = (first.left_m > 0.0) is (wish.side is Side.LEFT)
                words += f", from the {wish.side}."
                yield find(FindingKind.ASKED_SIDE, fits, [agent], words)
        case planned.MotionPreset.EMERGENCY_STOP:
            bend_m, at_m = find_bend_end(case.route) or 0.0, last.ahead_m
            words = f"{{agents[0]}} stops {at_m:.1f} m ahead; the bend ends at {bend_m:.1f} m."
            yield find(FindingKind.ASKED_DISTANCE, at_m >= bend_m, [agent], words)
        case planned.MotionPreset.DOOR_OPENING:
            toward_m = abs(first.left_m) - abs(last.left_m)
            what = "How far {agents[0]} comes towards the ego's way"
            yield hold(FindingKind.ASKED_MOTION, [agent], what, toward_m, DOOR)


def _numbers(
    case: Case,
    agent: TrafficAgent,
    motion: planned.PlannedMotion,
    wish: MotionWish,
    states: FloatArray,
) -> Iterator[Finding]:
    # Speeds are linear from pair to pair, so each leg has one deceleration.
    profile, slows = [(0.0, agent.speed_mps), *motion.speeds], wish.preset in SLOWS
    braking = [(a - b) / (to - at) for (at, a), (to, b) in pairwise(profile) if to > at]
    moves = states[:, 3] > 0.0
    if wish.preset is planned.MotionPreset.CUT_IN:
        lefts_m = np.array([case.route.locate(x, y).left_m for x, y in states[:, :2].tolist()])
        # (T,): a cut-in lasts until it is in its new lane, not until it stands.
        moves = np.abs(lefts_m - lefts_m[-1]) > _THERE_M
    measured = {
        "speed_mps": ("The speed in the end of {agents[0]}", profile[-1][1], "m/s"),
        "braking_mps2": ("The braking of {agents[0]}", max(braking, default=0.0), "m/s²"),
        "duration_s": ("The duration for {agents[0]}", STEP_S * np.count_nonzero(moves), "s"),
    }
    usual = {"speed_mps": Bounds(0.0, 0.0, 1.0), "braking_mps2": BRAKES} if slows else {}
    for name, (what, value, unit) in measured.items():
        amount = getattr(wish, name)
        wanted = motion_bounds(name, amount.low, amount.high) if amount else usual.get(name)
        if wanted is not None:
            yield hold(FindingKind.ASKED_MOTION, [agent], what, float(value), wanted, unit=unit)
