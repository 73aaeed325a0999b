"""What an open wish is for, measured: how late a pedestrian is seen, how wide a way is left.

Nobody's answer is held against another one: of a change only the effect counts. The ego drives as
`find_motion` has it, whatever it sees. Frame: the scene's. T steps.
"""

from collections.abc import Iterator

import numpy as np
import shapely
from shapely.ops import substring

from augment.checks.finding import Finding, FindingKind, find
from augment.checks.ground import VEHICLES, ChangedScene
from augment.checks.motions import box_at
from augment.checks.parties import Bounds, Case, hold
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType
from augment.scene.intent_parts import Amount, Purpose
from augment.scene.motion import Motion, Movement

WIDEST_M, LONGEST_TTC_S = 8.0, 3.0
"""Wider ways and longer times are not told apart."""
# Beside the route; before the ego and past the furthest change; ahead where nothing changed.
_ASIDE_M, _BEYOND_M, _LOOKS_M = 15.0, 10.0, 60.0
_SETS_OUT_WITHIN_M = 2.0
# Of 8 m, down to 2 mm; as much of an arc's chords comes on top.
_HALVINGS, _EXACT_M = 12, 0.005


def check_purpose(case: Case) -> Iterator[Finding]:
    """Hold what a scene alone tells of a purpose against its windows; drives tell the rest."""
    purpose, change = case.purpose, case.modification
    if purpose is None:
        return
    situation, changed = ChangedScene.of(case.ground, change), change.changed
    if purpose.sight is not None:
        wanted = Bounds(purpose.sight.low_m, purpose.sight.high_m, 0.0)
        seen_m = measure_sight(situation)
        if seen_m:
            nearest_m = min(seen_m.values(), key=wanted.off)
            what = "The ego's distance when it first sees the pedestrian"
            yield hold(FindingKind.PURPOSE, changed, what, nearest_m, wanted)
        else:
            words = "Nobody on foot who gets into the ego's way is hidden from it at first."
            yield find(FindingKind.PURPOSE, False, changed, words)
    if purpose.passage is not None:
        wanted = Bounds(purpose.passage.low_m, purpose.passage.high_m, _EXACT_M)
        what = "The width of the widest way past"
        yield hold(FindingKind.PURPOSE, changed, what, measure_passage(situation), wanted)


def check_drive(
    purpose: Purpose, planner: str, *, braking_mps2: float, ttc_s: float, crashes: bool
) -> Iterator[Finding]:
    """Hold a drive against the windows of a purpose that are about driving, if it has any.

    Args:
        purpose: What the change that was driven is for.
        planner: Who drove.
        braking_mps2: The hardest braking that it was forced to.
        ttc_s: Its least time to collision; infinite above what is measured.
        crashes: Whether it touched anybody.
    """
    windows: tuple[tuple[Amount | None, str, float, str], ...] = (
        (purpose.braking_mps2, "The hardest braking required of", braking_mps2, "m/s²"),
        (purpose.ttc_s, "The least time to collision of", min(ttc_s, LONGEST_TTC_S), "s"),
    )
    for window, what, value, unit in windows:
        if window is not None:
            wanted = Bounds(window.low, window.high, 0.0)
            yield hold(FindingKind.PURPOSE, [], f"{what} {planner}", value, wanted, unit=unit)
    if crashes and (purpose.braking_mps2 or purpose.ttc_s):
        yield find(FindingKind.PURPOSE, False, [], f"{planner} crashes.")


def measure_sight(situation: ChangedScene) -> dict[str, float]:
    """Return how near in m the ego is to pedestrians when it first sees them, by their ids.

    Between the centres of both. Only of those who are hidden at t0 and get into the ego's way
    ahead of it. Any part of a pedestrian that the middle of the ego has a free line to is seen.
    """
    route, seen_m = situation.ground.route, dict[str, float]()
    if route is None:
        return seen_m
    motion = situation.motion
    for walker in motion.others:
        is_walker = walker.agent.type is AgentType.PEDESTRIAN
        if not is_walker or not _gets_in_way(walker, motion.ego, route):
            continue
        if step := _find_first_sight(walker, motion):
            apart = walker.states[step, :2] - motion.ego.states[step, :2]
            seen_m[walker.agent.id] = float(np.hypot(*apart))
    return seen_m


def measure_passage(situation: ChangedScene) -> float:
    """Return the width in m of the widest way on the road past what stands, 0 for none.

    That is the diameter of the largest disc that gets from the ego, or from 2 m beside it, past
    the furthest change; either side of the road counts. Who stands and never sets out is an
    obstacle.
    """
    route, ground = situation.ground.route, situation.ground
    if route is None:
        return 0.0
    ends_m = [route.locate_agent(agent).ahead_m for agent in situation.changed]
    # Past the furthest change, but not past where the map ends.
    end_m = min(max(ends_m, default=_LOOKS_M) + _BEYOND_M, route.ends_m[-1] - _BEYOND_M)
    line = shapely.LineString(route.line.points_m)
    span = substring(line, route.ego_s_m - _BEYOND_M, route.ego_s_m + end_m + _BEYOND_M)
    road = ground.road.within(span.buffer(_ASIDE_M, cap_style="flat"))
    standing = [
        shapely.Polygon(situation.boxes[agent.id].corners_m)
        for agent in situation.everyone
        if agent.type is not AgentType.EGO_VEHICLE
        and agent.is_stopped
        and agent.motion is None
        and agent.walk_to_m is None
    ]
    free = shapely.difference(road, shapely.union_all(standing))
    begin = shapely.Point(situation.ground.scene.ego.x_m, situation.ground.scene.ego.y_m)
    goal = shapely.LineString([route.position(end_m, left_m) for left_m in (-_ASIDE_M, _ASIDE_M)])

    def lets_through(width_m: float) -> bool:
        # A disc fits where its centre is at least its radius away from every edge.
        rooms = shapely.get_parts(shapely.buffer(free, -width_m / 2.0))
        begins = shapely.distance(rooms, begin) <= _SETS_OUT_WITHIN_M
        return bool((begins & shapely.intersects(rooms, goal)).any())

    # Halved, as a way that lets one disc through lets every smaller one through.
    low_m, high_m = 0.0, WIDEST_M
    if lets_through(high_m):
        return high_m
    for _ in range(_HALVINGS):
        middle_m = (low_m + high_m) / 2.0
        low_m, high_m = (middle_m, high_m) if lets_through(middle_m) else (low_m, middle_m)
    return low_m


# Private


def _gets_in_way(walker: Movement, ego: Movement, route: EgoRoute) -> bool:
    """Return whether its body gets in front of the ego's, before the ego has passed."""
    # Half of both widths: nearer to the way than this the bodies would touch.
    half_m = (walker.agent.width_m + ego.agent.width_m) / 2.0
    there = walker.is_present
    ways = zip(ego.states[there, :2].tolist(), walker.states[there, :2].tolist(), strict=True)
    for mine, theirs in ways:
        place = route.locate(*theirs)
        if abs(place.left_m) <= half_m and place.ahead_m > route.locate(*mine).ahead_m:
            return True
    return False


def _find_first_sight(walker: Movement, motion: Motion) -> int | None:
    """Return the first step at which the ego sees any of its corners or its middle."""
    # Everything but vehicles is too low or too slim to hide a pedestrian.
    screens = [movement for movement in motion.others if movement.agent.type in VEHICLES]
    for step, ((x_m, y_m), state) in enumerate(
        zip(motion.ego.states[:, :2].tolist(), walker.states, strict=True)
    ):
        if not walker.is_present[step]:
            continue
        points = np.vstack([box_at(walker.agent.box, state).corners_m, state[:2]])
        eye = np.broadcast_to((x_m, y_m), points.shape)
        lines = np.asarray(shapely.linestrings(np.stack([eye, points], axis=1)))  # (5,)
        boxes = [
            box_at(movement.agent.box, movement.states[step]).corners_m
            for movement in screens
            if movement.is_present[step]
        ]
        bodies = np.asarray(shapely.polygons(np.array(boxes).reshape(-1, 4, 2)))  # (B,)
        # (5, B): hidden where every one of the lines meets some body.
        if not shapely.intersects(lines[:, None], bodies[None, :]).any(axis=1).all():
            return step
    return None
