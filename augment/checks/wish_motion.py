"""Distance of a motion from the nearest one that an intent admits.

In: an agent over time, and the admissible place nearest to where it is at t0. Out: metres, the
mean over `HORIZON_S`. What the sentence fixes holds without tolerance; what it leaves open is
taken from the answer as far as its kind manages that, then from usual motions, and the nearest of
them is refined. Only what a film shows counts: where somebody is, not how a motion is written.
Frame: the scene's. T steps.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from augment.checks.asked_motions import BRAKES, DOOR, SLOWS, check_path
from augment.checks.lanes_across import find_mark
from augment.checks.motions import LIMITS, measure_bends
from augment.checks.parties import Case
from augment.checks.wish_places import Span
from augment.errors import CannotPlace
from augment.scene import planned_motion as planned
from augment.scene import presets
from augment.scene.entities import Point, TrafficAgent
from augment.scene.intent import MotionWish, Request, Spot, StartWish, VehicleRequest
from augment.scene.motion import HORIZON_S, STEP_S, FloatArray, Motion, Movement
from augment.scene.planned_mover import walk_as_motion, way_and_speed

_FURTHER_S = 15.0
"""So long after its start a motion is followed to see where it leads."""
_NONE_M = 0.005
"""Nothing nearer than this is looked for."""
_GENTLEST_MPS2, _USUAL_MPS2 = 1.0, 3.0
"""Who is to come to a speed does so at least as briskly, where nobody says; as presets do."""
_CHANGES_M = 10.0, 60.0
"""How long a lane change may be that is looked for beside the answer's own."""
_SHARES = 0.25, 0.05
"""Steps by which open numbers are varied, as shares of their ranges; three to either side."""
_MIDDLE_M = 0.1
"""So near to a lane's centre a path ends in it: maps have corners."""
_HINGED_M = 0.15
"""A closed door's edge is so near to its car's side."""
_OPENS_S = 0.3, 3.0
_WIDER = 1.0, 1.005, 1.01, 1.02, 1.05
"""Bends are measured by chords, so as little more as helps than what is needed."""

Speeds = tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionCase:
    """One agent that is to move, and what its motion is held against.

    Attributes:
        whole: The modification that it is of.
        motion: Everybody after it.
        answer: The agent among them.
        placed: The agent at the admissible place nearest to it, as fast as is asked for at t0.
        wish: None where no motion is asked for: it is to go on as it is at t0.
        car: Of a door, at its admissible place.
    """

    whole: Case
    motion: Motion
    answer: Movement
    placed: TrafficAgent
    wish: MotionWish | None
    car: TrafficAgent | None = None

    @property
    def own(self) -> planned.PlannedMotion:
        """The answer's motion, its walk as one, else one that changes nothing."""
        return walk_as_motion(self.answer.agent).motion or planned.PlannedMotion()

    @property
    def own_start_s(self) -> float:
        """When the answer sets out, infinite where it never does."""
        if self.own == planned.PlannedMotion():
            return 0.0
        return math.inf if self.answer.started_s is None else self.answer.started_s

    def carry_out(self, agent: TrafficAgent, until_s: float = HORIZON_S) -> FloatArray:
        """Return the states (T, 4) of an agent whose motion, if any, waits for nobody."""
        # Half a step more, so that rounding loses no last step.
        times_s = np.arange(0.0, until_s + STEP_S / 2.0, STEP_S).tolist()
        return self.whole.carry_out(agent, times_s)

    def give(self, path: planned.Path | None, speeds: Speeds, after_s: float) -> TrafficAgent:
        """Return the agent with a motion that starts then, at its admissible place."""
        start = planned.AtTime(after_s=after_s)
        motion = planned.PlannedMotion(path=path, speeds=speeds, start=start)
        return replace(self.placed, walk_to_m=None, motion=motion)

    def find_offsets(self, agent: TrafficAgent) -> FloatArray:
        """Return from an agent to the answer (T, 2), in m; NaN where one is past the map."""
        states = self.carry_out(agent)
        return np.asarray(self.answer.states[: len(states), :2] - states[:, :2])

    def measure(self, agent: TrafficAgent) -> float:
        """Return how far the answer is from an agent on average, in m."""
        # (T,) distances; steps past the map count nothing.
        return float(np.nanmean(np.hypot(*self.find_offsets(agent).T)))

    def find_nearest(self) -> TrafficAgent:
        """Return the agent with the nearest admissible motion."""
        if self.wish is None:
            return replace(self.placed, motion=None)
        if self.car is not None:
            return min(_list_doors(self, self.car, self.wish), key=self.measure)
        return _Search(self, self.wish).run()


def measure_placed(
    case: Case,
    motion: Motion | None,
    request: Request,
    placed: TrafficAgent,
    car: TrafficAgent | None,
    place: Callable[[Request, list[TrafficAgent]], list[Point]],
) -> float:
    """Return how far an agent is from its wish: over time where it moves or is to, else at t0.

    Args:
        case: The modification that it is of.
        motion: Everybody after it; None where nobody has a motion or is to have one.
        request: What it answers.
        placed: One that is added or moved, at the admissible place nearest to it.
        car: Of a door, where it belongs.
        place: Finds the admissible places nearest to those who answer a request.
    """
    wish: MotionWish | None = getattr(request, "motion", None)
    agents = {agent.id: agent for agent in case.modification.changed}
    agent = agents[placed.id]
    is_driven = agent.motion is not None and isinstance(request, VehicleRequest)
    if motion is None or not (wish or is_driven):
        return math.dist(placed.pose.beside(0.0), agent.pose.beside(0.0))
    before = {other.id: other for other in case.route.scene.agents}
    if isinstance(request, VehicleRequest):
        if request.spot == Spot():
            placed = before.get(agent.id, placed)
        speed_mps = placed.speed_mps if request.speed_mps is None else request.speed_mps
        placed = replace(placed, speed_mps=speed_mps)
        lanes, spot = case.lanes.over(request.spot.via) or case.lanes, request.spot
        station_m = lanes.route.locate_agent(placed).ahead_m
        band = lanes.band(spot.lane, station_m) if spot.lane else None
        if band is not None and request.facing is None:
            placed = replace(placed, heading_rad=band.tangent_rad, lane_id=band.lane_id)
    else:
        placed = replace(placed, speed_mps=0.0)  # who is to walk or to open later waits
    (answer,) = (other for other in motion.others if other.agent.id == agent.id)
    at_t0 = MotionCase(whole=case, motion=motion, answer=answer, placed=placed, wish=wish, car=car)
    nearest = at_t0.find_nearest()
    nearest_m = at_t0.measure(nearest)
    if nearest_m <= _NONE_M or request.count != 1 or request.name or placed.id in before:
        return nearest_m
    # Over time another place may be nearer than the one at t0: that of the mean over (T,).
    ahead_m, aside_m = np.nanmean(at_t0.find_offsets(nearest), axis=0).tolist()
    moved = replace(agent, x_m=nearest.x_m + ahead_m, y_m=nearest.y_m + aside_m)
    ((x_m, y_m),) = place(request, [moved])
    again = replace(at_t0, placed=replace(placed, x_m=x_m, y_m=y_m))
    return min(nearest_m, again.measure(again.find_nearest()))


# Private


class _Search:
    """The nearest admissible motion, or the nearest of all until one is admissible."""

    def __init__(self, case: MotionCase, wish: MotionWish) -> None:
        self._case, self._wish = case, wish
        # Path, speeds and start.
        self._best: tuple[planned.Path | None, Speeds, float] = (None, (), 0.0)
        self._best_m, self._fits = math.inf, False

    def run(self) -> TrafficAgent:
        """Return the agent with the nearest motion."""
        case, wish = self._case, self._wish
        for speeds in _list_speeds(case, wish):
            for span in _list_starts(case, wish, speeds):
                after_s = _shift(case.own_start_s, 0.0, span)
                for path in _list_paths(case, wish, after_s, speeds):
                    self._try(path, speeds, after_s)
        for share in _SHARES:
            self._vary(share)
        return self._case.give(*self._best)

    def _try(self, path: planned.Path | None, speeds: Speeds, after_s: float) -> None:
        if self._fits and self._best_m <= _NONE_M:
            return
        agent = self._case.give(path, speeds, after_s)
        mean_m = self._case.measure(agent)
        # Admissibility is the dear part: it is asked only of what is nearer than the best.
        if self._fits and mean_m >= self._best_m:
            return
        fits = _is_admissible(self._case, agent, self._wish, after_s)
        if fits or (not self._fits and mean_m < self._best_m):
            self._best_m, self._best, self._fits = mean_m, (path, speeds, after_s), fits

    def _vary(self, share: float) -> None:
        """Vary the ramp, the start and the length of a lane change of the nearest, in turn."""
        steps = [share * step for step in (-3, -2, -1, 1, 2, 3)]
        ramp = _find_ramp(self._case, self._wish)
        for step in steps if self._best[1] else ():
            takes_s = _shift(self._best[1][-1][0], step, (ramp.least_s, ramp.most_s))
            self._try_from(((takes_s, ramp.to_mps),), 0.0)
        for step in steps:
            self._try_from(self._best[1], step)
        for step in () if self._wish.duration_s else steps:
            path, speeds, after_s = self._best
            if isinstance(path, planned.LanePath):
                changed = replace(path, change_m=_shift(path.change_m, step, _CHANGES_M))
                self._try(changed, speeds, after_s)

    def _try_from(self, speeds: Speeds, step: float) -> None:
        path, _, after_s = self._best
        for span in _list_starts(self._case, self._wish, speeds):
            self._try(path, speeds, _shift(after_s, step, span))


def _shift(value: float, share: float, span: Span) -> float:
    """Return a number moved by a share of its range, within that."""
    low, high = span
    # What never begins has no range: from infinity to infinity.
    return min(max(value + (share * (high - low) if share and high > low else 0.0), low), high)


def _is_admissible(
    case: MotionCase, agent: TrafficAgent, wish: MotionWish, after_s: float
) -> bool:
    """Return whether a motion leads where the wish has it, on a path that its kind can drive."""
    begins_s = min(after_s, HORIZON_S)
    states = case.carry_out(agent, begins_s + _FURTHER_S)[round(begins_s / STEP_S) :]
    states = states[~np.isnan(states[:, 0])]
    exact = replace(case.whole, tolerances=replace(case.whole.tolerances, middle_m=_MIDDLE_M))
    if not len(states) or any(
        finding.is_fault for finding in check_path(exact, agent, wish, states)
    ):
        return False
    limits = LIMITS.get(agent.type)
    if limits is None:
        return True
    sideways, curvature = measure_bends(states)
    return sideways <= limits.sideways and curvature <= 1.0 / limits.radius_m


def _list_starts(case: MotionCase, wish: MotionWish, speeds: Speeds) -> Iterator[Span]:
    """Yield from when to when a motion may begin, once for each reading of the sentence."""
    start = wish.start
    if start is None:
        yield case.own_start_s, case.own_start_s
    elif start.after_s is not None:
        low_s, high_s = start.after_s.low, start.after_s.high
        yield low_s, high_s
        takes_s = speeds[-1][0] if speeds else 0.0
        if start.may_end and high_s >= takes_s:
            yield max(low_s - takes_s, 0.0), high_s - takes_s
    else:
        yield from _find_reached(case, start)


@lru_cache(maxsize=16)  # a search asks for each of its motions
def _find_reached(case: MotionCase, start: StartWish) -> list[Span]:
    """Return when the ego is as near as is asked for: as the crow flies, and along the lane."""
    times_s = case.motion.times_s
    places = case.carry_out(case.give(None, (), math.inf), times_s[-1])[: len(times_s), :2]
    mark_m = find_mark(case.whole.lanes, start.mark) if start.mark else None
    if mark_m is not None:
        places[:] = case.whole.route.position(mark_m)
    # (T,) of the ego from where the agent waits, or from the place that is named.
    egos = case.motion.ego.states[: len(places), :2]
    readings_m = [np.hypot(*(egos - places).T)]
    if mark_m is None:
        locate = case.whole.route.locate
        at_m, ego_m = ([locate(*point).ahead_m for point in both] for both in (places, egos))
        readings_m.append(np.abs(np.subtract(at_m, ego_m)))
    near = start.ego_distance
    # The ego comes within the farther end first: that is the earliest start.
    reaches_m = near.span_m[::-1] if near else (planned.REACHED_M,) * 2
    spans = []
    for apart_m in readings_m:
        steps = (np.flatnonzero(apart_m <= reach_m) for reach_m in reaches_m)
        first_s, last_s = (float(times_s[at[0]]) if len(at) else math.inf for at in steps)
        spans.append((first_s, last_s))
    return spans


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ramp:
    """A speed that is come to, evenly, and how long that may take."""

    to_mps: float
    least_s: float
    most_s: float


def _find_ramp(case: MotionCase, wish: MotionWish) -> _Ramp:
    from_mps, slows = case.placed.speed_mps, wish.preset in SLOWS
    to_mps = case.own.speeds[-1][1] if case.own.speeds else from_mps
    if wish.speed_mps is not None:
        to_mps = _shift(to_mps, 0.0, (wish.speed_mps.low, wish.speed_mps.high))
    elif slows or not case.placed.is_stopped:
        to_mps = 0.0 if slows else from_mps
    limits = LIMITS.get(case.placed.type)
    # Who has no limits may change its speed at once.
    most_mps2 = math.inf
    if limits is not None:
        most_mps2 = limits.braking if to_mps < from_mps else limits.speeding_up
    least_mps2 = BRAKES.low if slows else _GENTLEST_MPS2
    if wish.braking_mps2 is not None:
        least_mps2, most_mps2 = wish.braking_mps2.low, wish.braking_mps2.high
    change_mps = abs(to_mps - from_mps)
    # The hardest change takes the least time.
    return _Ramp(to_mps=to_mps, least_s=change_mps / most_mps2, most_s=change_mps / least_mps2)


def _list_speeds(case: MotionCase, wish: MotionWish) -> Iterator[Speeds]:
    """Yield the answer's speeds where they are admissible, and the ramp nearest to them."""
    ramp, speeds = _find_ramp(case, wish), case.own.speeds
    from_mps = case.placed.speed_mps
    change_mps = abs(ramp.to_mps - from_mps)
    rows = speeds if speeds and speeds[0][0] == 0.0 else ((0.0, from_mps), *speeds)
    steps = np.abs(np.diff(np.array(rows), axis=0))  # (R - 1, 2) of seconds and m/s
    steepest = (steps[:, 1] / steps[:, 0]).tolist()
    if rows[0][1] != from_mps:
        steepest.append(math.inf)  # a jump, which people manage
    # As long as a ramp that is as steep as its steepest part.
    takes_s = change_mps / max(steepest, default=math.inf) if change_mps else 0.0
    if rows[-1][1] == ramp.to_mps and ramp.least_s <= takes_s <= ramp.most_s:
        yield speeds
    own_s, span = speeds[-1][0] if speeds else 0.0, (ramp.least_s, ramp.most_s)
    for takes_s in {_shift(value_s, 0.0, span) for value_s in (own_s, change_mps / _USUAL_MPS2)}:
        yield ((takes_s, ramp.to_mps),) if change_mps else ()


def _list_paths(
    case: MotionCase, wish: MotionWish, after_s: float, speeds: Speeds
) -> Iterator[planned.Path | None]:
    """Yield the answer's path, the same from where it has to begin, and the usual one."""
    own = case.own.path
    if wish.preset in (*SLOWS, planned.MotionPreset.RED_LIGHT):
        yield None
    if wish.preset in SLOWS:
        return
    if isinstance(own, planned.LanePath) and wish.duration_s is not None:
        # The sentence has seconds, a path has metres.
        mean_mps = (case.placed.speed_mps + _find_ramp(case, wish).to_mps) / 2.0
        span = wish.duration_s.low * mean_mps, wish.duration_s.high * mean_mps
        own = replace(own, change_m=_shift(own.change_m, 0.0, span))
    if own is not None:
        yield own
    if isinstance(own, planned.PointPath):
        here = case.carry_out(case.give(None, (), math.inf), min(after_s, HORIZON_S))[-1, :2]
        began_s = min(case.own_start_s, HORIZON_S)
        # (P, 2) from its beginning, moved there and widened where they turn too narrowly.
        ways_m = own.points_m - case.answer.states[round(began_s / STEP_S), :2]
        needed = _find_scale(case)
        for scale in (1.0, *(wider * needed for wider in _WIDER if needed > 1.0)):
            points = here + scale * ways_m
            if not np.isnan(points).any():
                yield replace(own, points_m=tuple((x_m, y_m) for x_m, y_m in points.tolist()))
    numbers = presets.PresetNumbers(start=planned.AtTime(after_s=min(after_s, HORIZON_S)))
    if speeds and "speed_mps" in presets.preset_numbers(wish.preset):
        numbers = replace(numbers, speed_mps=speeds[-1][1])
    try:
        usual = presets.with_preset(wish.preset, case.whole.ground.scene, case.placed, numbers)
    except CannotPlace:
        return
    assert usual.motion is not None
    yield usual.motion.path


def _find_scale(case: MotionCase) -> float:
    """Return how much wider the answer's bends would have to be for its kind, at least 1."""
    limits = LIMITS.get(case.placed.type)
    if limits is None:
        return 1.0
    sideways, curvature = measure_bends(case.answer.states)
    return max(1.0, sideways / limits.sideways, curvature * limits.radius_m)


def _list_doors(case: MotionCase, car: TrafficAgent, wish: MotionWish) -> Iterator[TrafficAgent]:
    """Yield doors in the car's side, along it or across it, that come out on the ego's side."""
    door, own, place = case.answer.agent, case.own, case.whole.route.locate_agent(car)
    # (2,) turns the car's frame over, so that out of the door's side is positive.
    side = np.array([1.0, presets.find_door_side(car, place)])
    at_once = replace(door, motion=replace(own, start=planned.AtTime()))
    local = car.pose.to_local(case.carry_out(at_once)[[0, -1], :2]) * side  # shut, open
    half_m, slab_m, reach_m = car.width_m / 2.0, presets.DOOR_WIDTH_M, presets.DOOR_LENGTH_M
    ends_m = (car.length_m - reach_m) / 2.0
    opens_s = (wish.duration_s.low, wish.duration_s.high) if wish.duration_s else _OPENS_S
    for low_m, high_m in (
        (half_m - slab_m / 2.0, half_m + slab_m / 2.0 + _HINGED_M),
        ((half_m - reach_m / 2.0) - _HINGED_M, (half_m - reach_m / 2.0) + _HINGED_M),
    ):
        # (2,) ahead in the car and out of it; a hinge moves the centre by half its length at most.
        closed = np.clip(local[0], (-ends_m, low_m), (ends_m, high_m))
        way = np.clip(local[-1] - closed, (-reach_m / 2.0, DOOR.low), (reach_m / 2.0, DOOR.high))
        (x_m, y_m), end = car.pose.to_parent(np.array([closed, closed + way]) * side).tolist()
        way_m = float(np.hypot(*way))
        takes_s = _shift(_takes_s(own.speeds, way_m), 0.0, opens_s)
        at_door = replace(case, placed=replace(door, x_m=x_m, y_m=y_m))
        speeds = ((0.0, way_m / takes_s),)
        path = planned.PointPath(points_m=((end[0], end[1]),), keeps_heading=True)
        for span in _list_starts(at_door, wish, speeds):
            yield at_door.give(path, speeds, _shift(case.own_start_s, 0.0, span))


def _takes_s(speeds: Sequence[tuple[float, float]], way_m: float) -> float:
    """Return how long somebody who stands takes for so many metres."""
    times_s = np.arange(0.0, _FURTHER_S, STEP_S).tolist()
    enough_m, row = way_m - _NONE_M, tuple(speeds)
    return next((t for t in times_s if way_and_speed(row, 0.0, t)[0] >= enough_m), _FURTHER_S)
