"""PDM-Closed: the best of several rolled-out proposals, or an emergency brake.

Proposals are IDM policies of several speeds on parallel paths. P paths, V policies; proposal
number p * V + v. B proposals, T moments every 0.1 s, A objects, F slices every 0.2 s; a moment
takes the slice at or before it. Source: the facts on PDM-Closed in docs/simulation.md.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from augment.simulation import planning, shapes
from augment.simulation.comfort import PROPOSAL, comfort_signals, is_comfortable
from augment.simulation.road import Road
from augment.simulation.states import (
    ACCELERATION,
    AHEAD_RAD,
    BEHIND_RAD,
    SPEED,
    STEP_S,
    BoolArray,
    EgoBody,
    FloatArray,
    IntArray,
    Kind,
    Objects,
    X,
    Y,
    are_at_fault,
    classify_contacts,
)
from augment.simulation.tracker import track

PROPOSAL_IDM = planning.Idm(1.5, 3.0, 10.0)
"""PDM-Closed's policies."""
ORIGINAL_OFFSETS_M = (0.0, -1.0, 1.0)
"""The centreline first: of equal scores, all zero among them, the lowest number wins."""
PAPER_OFFSETS_M = (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0)
"""The paper says up to 4 m; steps of 1 m and their order are our reading."""
# Of the speed limit: one policy each.
SPEED_SHARES = np.array([0.2, 0.4, 0.6, 0.8, 1.0])
# Steps of 0.1 s: proposals are judged over 4 s, the plan and what others do go on to 8 s.
HORIZON_STEPS = 40
WHOLE_STEPS = 80
FAULT_WITHIN_S = 2.0
AT_MOST_MPS = 5.0
_LOW_MPS = 0.2
# m/s^2, the limits of the comfort of longitudinal acceleration.
_HARDEST, _SOFTEST = -4.05, 2.40
_STILL_MPS = 5e-3
# Steps of 0.1 s ahead of each moment.
_TTC_STEPS = (0, 3, 6, 9)
_PROGRESS_WEIGHT, _TTC_WEIGHT, _COMFORT_WEIGHT = 5.0, 5.0, 2.0
_LITTLE_PROGRESS_M = 0.1
# The multiplier that is left after a collision with something static.
_STATIC_HIT = 0.5
_ONCOMING_FREE_M, _ONCOMING_HALF_M = 2.0, 6.0


def must_brake(fault_s: float, speed_mps: float) -> bool:
    """Return whether even the best proposal soon hits somebody, at a speed to brake from."""
    return fault_s <= FAULT_WITHIN_S and speed_mps <= AT_MOST_MPS


def brake(ego: FloatArray, body: EgoBody) -> FloatArray:
    """Return poses (T, 3) straight ahead from the ego's centre, at one commanded speed.

    The commanded speed may be negative; the tracker turns that into hard braking.
    """
    speed = float(ego[SPEED])
    wished = -10.0 * speed if speed > _LOW_MPS else -4.0 * speed - float(ego[ACCELERATION])
    commanded = speed + min(max(wished, _HARDEST), _SOFTEST)
    if speed > _LOW_MPS:
        commanded *= 1.1
    way_m = commanded * STEP_S * np.arange(WHOLE_STEPS + 1)
    return shapes.move_ahead(np.tile(body.boxes(ego), (len(way_m), 1)), way_m)


class PdmClosed:
    """The planner of the paper's benchmark.

    Args:
        offsets_m: Lateral offsets of the paths (P,), to the left; the paper's by default.
    """

    def __init__(self, offsets_m: tuple[float, ...] = PAPER_OFFSETS_M) -> None:
        self._offsets = np.array(offsets_m, dtype=np.float64)

    def start(self, road: Road, body: EgoBody) -> None:
        """Lay the paths beside the centreline."""
        self._road, self._body = road, body
        self._paths = planning.ParallelPaths(road.centreline, self._offsets)
        self._touched: set[str] = set()

    def plan(self, situation: planning.Situation) -> planning.Plan:
        """Roll out, simulate and judge proposals, and continue the best, or brake."""
        ego, body, paths = situation.ego, self._body, self._paths
        forecast = planning.foresee(self._see(situation), WHOLE_STEPS * STEP_S)
        ego_m = self._road.centreline.station_of(ego)
        limit = self._road.limit_at(ego_m)
        # (V,) wished speeds, and how far each leads in 8 s.
        targets = SPEED_SHARES * (planning.FALLBACK_LIMIT_MPS if math.isnan(limit) else limit)
        reaches_m = targets * WHOLE_STEPS * STEP_S
        furthest_m = reaches_m.max(keepdims=True)
        corridor = paths.corridor(forecast, ego_m, float(furthest_m[0]), body)
        corridor = self._with_red(corridor, ego_m + body.front_m)
        # (P, V): every policy on every path starts from the ego's own state.
        speeds = np.full((len(paths.paths), len(targets)), max(float(ego[SPEED]), 0.0))
        starts = np.broadcast_to(paths.stations(np.array([ego_m])), speeds.shape)
        first, rest = range(HORIZON_STEPS), range(HORIZON_STEPS, WHOLE_STEPS)
        # Over the first 4 s the furthest reach counts for all; then each policy's own.
        reached_m, speeds = self._roll_out(starts, speeds, targets, furthest_m, corridor, first)
        # (P, V, T, 3) as (B, T, 3), proposal p * V + v; what is judged is how the car follows it.
        states = track(paths.poses(reached_m).reshape(-1, HORIZON_STEPS + 1, 3), ego, body)
        judged = score_proposals(states, forecast, self._road, body)
        # Scores that differ by rounding alone are equal, and the lowest number wins.
        best = int(judged.scores.round(9).argmax())
        shown = planning.Proposals(states=states, scores=judged.scores, chosen=best)
        if must_brake(float(judged.fault_s[best]), float(ego[SPEED])):
            return planning.Plan(poses=brake(ego, body), proposals=shown, braking=True)
        # All go on from 4 s to 8 s; the winner's way is what is driven.
        ends = reached_m[..., -1]
        further_m, _ = self._roll_out(ends, speeds, targets, reaches_m, corridor, rest)
        path, policy = divmod(best, len(targets))
        # The last station of the first part is the first one of the second.
        stations = np.concatenate([reached_m[path, policy], further_m[path, policy, 1:]])
        return planning.Plan(poses=paths.paths[path].poses(stations), proposals=shown)

    def _see(self, situation: planning.Situation) -> Objects:
        """The objects that count: near, and not touching the ego since some step."""
        box = self._body.boxes(situation.ego)
        near = planning.nearest(situation.objects, box[:2])
        # Who touches the ego once is never a leader or an obstacle again.
        touching = shapes.meet(box, near.boxes)
        self._touched |= {name for name, hit in zip(near.ids, touching, strict=True) if hit}
        return near.chosen(np.array([name not in self._touched for name in near.ids], dtype=bool))

    def _with_red(self, corridor: planning.Corridor, front_m: float) -> planning.Corridor:
        """The corridor with something standing at each red light ahead."""
        red = self._road.red_stations_m
        red = red[red >= front_m]
        slices, paths = corridor.near_m.shape[:2]
        # (F, P, R): lights stand still, each as something whose middle is a metre past its line.
        stops = np.broadcast_to(self._paths.stations(red), (slices, paths, len(red)))
        return replace(
            corridor,
            near_m=np.concatenate([corridor.near_m, stops], axis=-1),
            middle_m=np.concatenate([corridor.middle_m, stops + 1.0], axis=-1),
            speeds_mps=np.hstack([corridor.speeds_mps, np.zeros((slices, len(red)))]),
        )

    def _roll_out(
        self,
        station: FloatArray,
        speed: FloatArray,
        targets_mps: FloatArray,
        reaches_m: FloatArray,
        corridor: planning.Corridor,
        steps: range,
    ) -> tuple[FloatArray, FloatArray]:
        """Every policy on every path, over some steps of the horizon.

        Args:
            station: (P, V) where the rear axle is.
            speed: (P, V) at the start.
            targets_mps: (V,) wished speeds.
            reaches_m: (V,) or (1,) how far ahead somebody counts.
            corridor: Who is on the paths.
            steps: Counted from now.

        Returns:
            Arc lengths (P, V, T) and the speeds (P, V) at the end.
        """
        stations = [station]
        near, leader = np.zeros(station.shape), np.zeros(station.shape)
        for step in steps:
            # Forecasts have slices of 0.2 s, roll-outs steps of 0.1 s.
            if step % planning.STEPS_A_SLICE == 0:
                near, leader = self._leaders(
                    station, corridor, step // planning.STEPS_A_SLICE, reaches_m
                )
            gap = near - station - self._body.front_m
            pull = PROPOSAL_IDM.clip(speed, targets_mps, gap, leader)
            # Explicit Euler: the place by the speed of before.
            station = station + speed * STEP_S
            speed = np.maximum(speed + pull * STEP_S, 0.0)
            stations.append(station)
        return np.stack(stations, axis=-1), speed

    def _leaders(
        self, station: FloatArray, corridor: planning.Corridor, moment: int, reaches_m: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the leader's rear (P, V), and its speed; of equal ones the first.

        As released: ahead is whose centre lies beyond the rear axle, even beside the ego itself.
        Something stands at the end of each path.
        """
        end = np.broadcast_to(
            (self._paths.ends_m - self._body.length_m / 2.0)[:, None], station.shape
        )
        moment = min(moment, len(corridor.near_m) - 1)
        # (P, 1, A) against stations (P, V, 1).
        near = corridor.near_m[moment][:, None, :]
        if near.shape[-1] == 0:
            return end, np.zeros(station.shape)
        middle, front = corridor.middle_m[moment][:, None, :], station[..., None]
        ahead = (middle > front) & (near - front < reaches_m[:, None])
        # (P, V, A); argmin takes the first of equally near ones.
        rear = np.where(ahead, near, np.inf)
        closest = rear.min(axis=-1)
        speeds = corridor.speeds_mps[moment][rear.argmin(axis=-1)]
        return np.minimum(closest, end), np.where(closest >= end, 0.0, speeds)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProposalScores:
    """Scores of B proposals.

    Attributes:
        scores: (B,) 0 to 1.
        fault_s: (B,) when the first collision at fault comes; inf without one.
        parts: Each (B,): collision, drivable, direction, progress, ttc, comfort.
    """

    scores: FloatArray
    fault_s: FloatArray
    parts: dict[str, FloatArray]


def score_proposals(
    states: FloatArray, forecast: planning.Forecast, road: Road, body: EgoBody
) -> ProposalScores:
    """Judge simulated states (B, T, 6)."""
    look = _Look(states, forecast, road, body)
    collision, fault_s = _collisions(look)
    drivable = np.where(look.off_road.any(axis=1), 0.0, 1.0)
    direction = _direction(look)
    valid = collision * drivable * direction
    parts = {
        "collision": collision,
        "drivable": drivable,
        "direction": direction,
        "progress": _progress(look, valid),
        "ttc": _time_to_collision(look),
        "comfort": is_comfortable(comfort_signals(states, body, PROPOSAL)).astype(np.float64),
    }
    weighted = _PROGRESS_WEIGHT * parts["progress"] + _TTC_WEIGHT * parts["ttc"]
    weighted = weighted + _COMFORT_WEIGHT * parts["comfort"]
    total = _PROGRESS_WEIGHT + _TTC_WEIGHT + _COMFORT_WEIGHT
    return ProposalScores(scores=valid * weighted / total, fault_s=fault_s, parts=parts)


class _Look:
    """The states with what several judgements need of them."""

    def __init__(
        self, states: FloatArray, forecast: planning.Forecast, road: Road, body: EgoBody
    ) -> None:
        self.states, self.road, self.body = states, road, body
        self.boxes = body.boxes(states)
        self.corners = shapes.corners(self.boxes)
        # Corners (B, T, 4, 2): off the road with any one of them, (B, T).
        self.off_road: BoolArray = np.any(~road.drivable.contains(self.corners), axis=-1)
        self.objects, self.moving_boxes = forecast.objects, forecast.boxes
        self._sizes = shapes.radii(forecast.boxes[0])

    def contacts(self, boxes: FloatArray, later: int) -> tuple[IntArray, IntArray, IntArray]:
        """Proposal, moment and object (K,) where boxes (B, T, 5), `later` steps on, meet."""
        # (T,) the slice of each moment; after the last one, that.
        moments = (np.arange(boxes.shape[1]) + later) // planning.STEPS_A_SLICE
        others = self.moving_boxes[np.minimum(moments, len(self.moving_boxes) - 1)]
        reach = (self._sizes + shapes.radii(boxes[0, 0])) ** 2
        dx = boxes[..., None, 0] - others[None, ..., 0]
        dy = boxes[..., None, 1] - others[None, ..., 1]
        # Circles round the boxes first, (B, T, A): few pairs are left for separating axes.
        proposal, moment, thing = np.nonzero(dx * dx + dy * dy <= reach)
        hit = shapes.meet(boxes[proposal, moment], others[moment, thing])
        return proposal[hit], moment[hit], thing[hit]

    def astray(self, proposal: IntArray, moment: IntArray) -> BoolArray:
        """Return whether the ego (K,) is off the road or not on one way; asks a place once."""
        # Several objects at one moment of a proposal ask for the same place.
        keys, back = np.unique(proposal * self.states.shape[1] + moment, return_inverse=True)
        rows, times = np.divmod(keys, self.states.shape[1])
        wrong = self.off_road[rows, times] | ~self.road.on_one_way(self.corners[rows, times])
        return np.asarray(wrong[back], dtype=np.bool_)


def _collisions(look: _Look) -> tuple[FloatArray, FloatArray]:
    """The multiplier (B,) and the first fault (B,) in s; of each pair the first contact counts."""
    count, never = look.states.shape[:2]
    multiplier, fault_s = np.ones(count), np.full(count, np.inf)
    proposal, moment, thing = look.contacts(look.boxes, 0)
    # (B, A) the first moment at which each proposal meets each object; T for never.
    first = np.full((count, len(look.objects)), never)
    np.minimum.at(first, (proposal, thing), moment)
    proposal, thing = np.nonzero(first < never)
    moment = first[proposal, thing]
    boxes = look.moving_boxes[moment // planning.STEPS_A_SLICE, thing]
    speeds, kinds = look.objects.speeds_mps[thing], look.objects.kinds[thing]
    states = look.states[proposal, moment]
    contacts = classify_contacts(states, boxes, speeds, kinds, look.body)
    guilty = are_at_fault(contacts, look.astray(proposal, moment))
    hits = np.where(kinds == Kind.STATIC, _STATIC_HIT, 0.0)
    # The worst of a proposal's collisions; `at`, as a proposal may have several.
    np.minimum.at(multiplier, proposal[guilty], hits[guilty])
    np.minimum.at(fault_s, proposal[guilty], moment[guilty] * STEP_S)
    return multiplier, fault_s


def _direction(look: _Look) -> FloatArray:
    """1, 0.5 or 0 (B,) by the longest way in one go with the centre on no way of the route."""
    centres = look.boxes[..., :2]
    against = ~look.road.on_route.contains(centres)
    # (B, T): metres driven off the route's ways since the moment before.
    steps = np.zeros(against.shape)
    steps[:, 1:] = np.hypot(*np.moveaxis(np.diff(centres, axis=1), -1, 0)) * against[:, 1:]
    gone = np.cumsum(steps, axis=1)
    # What was gone when the ego was last on the route: the difference is the present stretch.
    before = np.maximum.accumulate(np.where(against, 0.0, gone), axis=1)
    longest = (gone - before).max(axis=1)
    return np.select([longest < _ONCOMING_FREE_M, longest < _ONCOMING_HALF_M], [1.0, 0.5], 0.0)


def _progress(look: _Look, valid: FloatArray) -> FloatArray:
    """The advance along the centreline (B,) as a share of the best valid one."""
    start = look.road.centreline.station_of(look.boxes[0, 0])
    end, _ = look.road.centreline.beside(look.boxes[:, -1, :2])
    advance = np.maximum(end - start, 0.0) * valid
    if advance.max() > _LITTLE_PROGRESS_M:
        return np.asarray(advance / advance.max(), dtype=np.float64)
    return (valid > 0.0).astype(np.float64)


def _time_to_collision(look: _Look) -> FloatArray:
    """1, or 0 (B,) where going on as now would hit somebody within 0.9 s of some moment.

    Only the first such meeting with each object counts: one that does not matter, with somebody
    behind or beside, has that object left out of all later ones.
    """
    made = np.ones(len(look.states))
    meetings = [_meetings(look, later) for later in _TTC_STEPS]
    proposal, moment, thing, later = np.concatenate(meetings, axis=1)
    # By moment, then by how far ahead: the first row of each pair is its first meeting.
    order = np.lexsort((later, moment))
    pairs = (proposal * (len(look.objects) + 1) + thing)[order]
    first = order[np.unique(pairs, return_index=True)[1]]
    proposal, moment, thing, later = (row[first] for row in (proposal, moment, thing, later))
    moments = np.minimum((moment + later) // planning.STEPS_A_SLICE, len(look.moving_boxes) - 1)
    places = look.moving_boxes[moments, thing, :2]
    bearing = shapes.bearings(look.states[proposal, moment], places)
    made[proposal[bearing < AHEAD_RAD]] = 0.0
    # Those who failed already need no second look at the map.
    beside = (bearing >= AHEAD_RAD) & (bearing <= BEHIND_RAD) & (made[proposal] > 0.0)
    proposal, moment = proposal[beside], moment[beside]
    axles = look.states[proposal, moment][:, [X, Y]]
    loose = look.road.intersections.contains(axles) | look.astray(proposal, moment)
    made[proposal[loose]] = 0.0
    return made


def _meetings(look: _Look, later: int) -> IntArray:
    """Proposal, moment, object and steps (4, K) of who meets if the ego goes straight on."""
    boxes, speed = look.boxes.copy(), look.states[..., SPEED]
    boxes[..., :3] = shapes.move_ahead(boxes, speed * (later * STEP_S))
    proposal, moment, thing = look.contacts(boxes, later)
    meetings = np.stack([proposal, moment, thing, np.full(len(proposal), later)])
    return meetings[:, speed[proposal, moment] > _STILL_MPS]
