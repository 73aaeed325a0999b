"""PDM-Closed's judgement of its simulated proposals.

B proposals, T moments every 0.1 s, A objects, F slices every 0.2 s. A moment takes the slice at or
before it. Source: the facts on PDM-Closed in docs/simulation.md.
"""

from dataclasses import dataclass

import numpy as np

from augment.simulation.comfort import PROPOSAL, comfort_signals, is_comfortable
from augment.simulation.planning import STEPS_A_SLICE, Forecast
from augment.simulation.road import Road
from augment.simulation.states import (
    AHEAD_RAD,
    BEHIND_RAD,
    SPEED,
    STEP_S,
    BoolArray,
    EgoBody,
    FloatArray,
    IntArray,
    Kind,
    X,
    Y,
    are_at_fault,
    bearings,
    classify_contacts,
    corners,
    meet,
    moved_ahead,
    radii,
)

_STILL_MPS = 5e-3
_TTC_STEPS = (0, 3, 6, 9)
_PROGRESS_WEIGHT, _TTC_WEIGHT, _COMFORT_WEIGHT = 5.0, 5.0, 2.0
_LITTLE_PROGRESS_M = 0.1
_STATIC_HIT = 0.5
_ONCOMING_FREE_M, _ONCOMING_HALF_M = 2.0, 6.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProposalScores:
    """How good each of B proposals is.

    Attributes:
        scores: (B,) 0 to 1.
        fault_s: (B,) when the first collision at fault comes; inf without one.
        parts: Each (B,): collision, drivable, direction, progress, ttc, comfort.
    """

    scores: FloatArray
    fault_s: FloatArray
    parts: dict[str, FloatArray]


def score_proposals(
    states: FloatArray, forecast: Forecast, road: Road, body: EgoBody
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

    def __init__(self, states: FloatArray, forecast: Forecast, road: Road, body: EgoBody) -> None:
        self.states, self.road, self.body = states, road, body
        self.boxes = body.boxes(states)
        self.corners = corners(self.boxes)
        self.off_road: BoolArray = np.any(~road.drivable.contains(self.corners), axis=-1)
        self.objects, self.moving_boxes = forecast.objects, forecast.boxes
        self._sizes = radii(forecast.boxes[0])

    def contacts(self, boxes: FloatArray, later: int) -> tuple[IntArray, IntArray, IntArray]:
        """Proposal, moment and object (K,) where boxes (B, T, 5), `later` steps on, meet."""
        moments = (np.arange(boxes.shape[1]) + later) // STEPS_A_SLICE
        others = self.moving_boxes[np.minimum(moments, len(self.moving_boxes) - 1)]
        reach = (self._sizes + radii(boxes[0, 0])) ** 2
        dx = boxes[..., None, 0] - others[None, ..., 0]
        dy = boxes[..., None, 1] - others[None, ..., 1]
        proposal, moment, thing = np.nonzero(dx * dx + dy * dy <= reach)
        hit = meet(boxes[proposal, moment], others[moment, thing])
        return proposal[hit], moment[hit], thing[hit]

    def astray(self, proposal: IntArray, moment: IntArray) -> BoolArray:
        """Whether the ego (K,) is off the road or not on one way; each place is asked once."""
        keys, back = np.unique(proposal * self.states.shape[1] + moment, return_inverse=True)
        rows, times = np.divmod(keys, self.states.shape[1])
        wrong = self.off_road[rows, times] | ~self.road.on_one_way(self.corners[rows, times])
        return np.asarray(wrong[back], dtype=np.bool_)


def _collisions(look: _Look) -> tuple[FloatArray, FloatArray]:
    """The multiplier (B,) and the first fault (B,) in s; of each pair the first contact counts."""
    count, never = look.states.shape[:2]
    multiplier, fault_s = np.ones(count), np.full(count, np.inf)
    proposal, moment, thing = look.contacts(look.boxes, 0)
    first = np.full((count, len(look.objects)), never)
    np.minimum.at(first, (proposal, thing), moment)
    proposal, thing = np.nonzero(first < never)
    moment = first[proposal, thing]
    boxes = look.moving_boxes[moment // STEPS_A_SLICE, thing]
    speeds, kinds = look.objects.speeds_mps[thing], look.objects.kinds[thing]
    states = look.states[proposal, moment]
    contacts = classify_contacts(states, boxes, speeds, kinds, look.body)
    guilty = are_at_fault(contacts, look.astray(proposal, moment))
    hits = np.where(kinds == Kind.STATIC, _STATIC_HIT, 0.0)
    np.minimum.at(multiplier, proposal[guilty], hits[guilty])
    np.minimum.at(fault_s, proposal[guilty], moment[guilty] * STEP_S)
    return multiplier, fault_s


def _direction(look: _Look) -> FloatArray:
    """1, 0.5 or 0 (B,) by the longest way in one go with the centre on no way of the route."""
    centres = look.boxes[..., :2]
    against = ~look.road.on_route.contains(centres)
    steps = np.zeros(against.shape)
    steps[:, 1:] = np.hypot(*np.moveaxis(np.diff(centres, axis=1), -1, 0)) * against[:, 1:]
    gone = np.cumsum(steps, axis=1)
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
    order = np.lexsort((later, moment))
    pairs = (proposal * (len(look.objects) + 1) + thing)[order]
    first = order[np.unique(pairs, return_index=True)[1]]
    proposal, moment, thing, later = (row[first] for row in (proposal, moment, thing, later))
    moments = np.minimum((moment + later) // STEPS_A_SLICE, len(look.moving_boxes) - 1)
    places = look.moving_boxes[moments, thing, :2]
    bearing = bearings(look.states[proposal, moment], places)
    made[proposal[bearing < AHEAD_RAD]] = 0.0
    beside = (bearing >= AHEAD_RAD) & (bearing <= BEHIND_RAD) & (made[proposal] > 0.0)
    proposal, moment = proposal[beside], moment[beside]
    axles = look.states[proposal, moment][:, [X, Y]]
    loose = look.road.intersections.contains(axles) | look.astray(proposal, moment)
    made[proposal[loose]] = 0.0
    return made


def _meetings(look: _Look, later: int) -> IntArray:
    """Proposal, moment, object and steps (4, K) of who meets if the ego goes straight on."""
    boxes, speed = look.boxes.copy(), look.states[..., SPEED]
    boxes[..., :3] = moved_ahead(boxes, speed * (later * STEP_S))
    proposal, moment, thing = look.contacts(boxes, later)
    meetings = np.stack([proposal, moment, thing, np.full(len(proposal), later)])
    return meetings[:, speed[proposal, moment] > _STILL_MPS]
