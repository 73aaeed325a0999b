"""PDM-Closed's proposals: IDM policies of several speeds, rolled out on parallel paths.

P paths, V policies; proposal number p * V + v. Source: the facts on PDM-Closed in
docs/simulation.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from augment.simulation.forecast import STEPS_A_SLICE
from augment.simulation.idm import PROPOSAL_IDM
from augment.simulation.leaders import Corridor
from augment.simulation.states import STEP_S, EgoBody, FloatArray

ORIGINAL_OFFSETS_M = (0.0, -1.0, 1.0)
"""The centreline first: of equal scores, all zero among them, the lowest number wins."""
PAPER_OFFSETS_M = (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0)
"""The paper says up to 4 m; steps of 1 m and their order are our reading."""
SPEED_SHARES = (0.2, 0.4, 0.6, 0.8, 1.0)
HORIZON_STEPS = 40
WHOLE_STEPS = 80
FALLBACK_LIMIT_MPS = 15.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Quirks:
    """What the released code does that its paper does not say; all off by default.

    Attributes:
        first_step_brake: The leaders start as zeros and are first looked up in the second step,
            so that every proposal brakes at -3 m/s2 for one step.
        stale_leader: The five policies of one path share the speed and the length of the leader
            that the last of them saw.
    """

    first_step_brake: bool = False
    stale_leader: bool = False


@dataclass(slots=True, eq=False)
class Rollout:
    """Arc lengths and speeds of proposals, on their paths.

    Attributes:
        stations_m: (P, V, T) of the rear axle.
        speeds_mps: (P, V) at the end.
    """

    stations_m: FloatArray
    speeds_mps: FloatArray


def roll_out(
    start_m: FloatArray,
    speed_mps: float,
    targets_mps: FloatArray,
    corridor: Corridor,
    ends_m: FloatArray,
    body: EgoBody,
    quirks: Quirks,
    *,
    first: int = 0,
    last: int = HORIZON_STEPS,
) -> Rollout:
    """Every policy on every path, from one step of the horizon to another.

    Args:
        start_m: (P,) where the rear axle is on each path.
        speed_mps: At the start.
        targets_mps: (V,) wished speeds.
        corridor: Who is on the paths.
        ends_m: (P,) where the paths end; something stands there.
        body: The ego.
        quirks: Of the released code.
        first: The step that the start belongs to.
        last: Where to end.
    """
    shape = (len(start_m), len(targets_mps))
    station = np.repeat(start_m[:, None], shape[1], axis=1)
    speed = np.full(shape, max(speed_mps, 0.0))
    targets = np.broadcast_to(targets_mps, shape)
    reach = float(targets_mps.max()) * WHOLE_STEPS * STEP_S
    made = np.empty((last - first + 1, *shape))
    made[0] = station
    near, leader = np.zeros(shape), np.zeros(shape)
    refreshed_at = 1 if quirks.first_step_brake else 0
    for step in range(first, last):
        if step % STEPS_A_SLICE == refreshed_at:
            moment = (step + refreshed_at) // STEPS_A_SLICE
            near, leader = _leaders(station, corridor, moment, ends_m, reach, body, quirks)
        gap = near - station - body.front_m
        pull = PROPOSAL_IDM.clipped(speed, targets, gap, leader)
        station = station + speed * STEP_S
        speed = np.maximum(speed + pull * STEP_S, 0.0)
        made[step + 1 - first] = station
    return Rollout(stations_m=np.moveaxis(made, 0, -1), speeds_mps=speed)


def _leaders(
    station: FloatArray,
    corridor: Corridor,
    moment: int,
    ends_m: FloatArray,
    reach: float,
    body: EgoBody,
    quirks: Quirks,
) -> tuple[FloatArray, FloatArray]:
    """Where the leader's rear is (P, V), and its speed; nearest first, of equal ones the first."""
    # As released: ahead is whose centre lies beyond the rear axle, even beside the ego itself.
    end = np.broadcast_to((ends_m - body.length_m / 2.0)[:, None], station.shape)
    moment = min(moment, len(corridor.near_m) - 1)
    near = corridor.near_m[moment][:, None, :]
    if near.shape[-1] == 0:
        return end, np.zeros(station.shape)
    middle = corridor.middle_m[moment][:, None, :]
    front = station[..., None]
    ahead = (middle > front) & (near - front < reach)
    rear = np.where(ahead, near, np.inf)
    which = rear.argmin(axis=-1)
    found = np.take_along_axis(rear, which[..., None], axis=-1)[..., 0]
    speeds = corridor.speeds_mps[moment][which]
    if quirks.stale_leader:
        speeds = np.broadcast_to(speeds[:, -1:], speeds.shape)
        lengths = corridor.lengths_m[which]
        found = found + (lengths - lengths[:, -1:]) / 2.0
    beyond = found >= end
    return np.where(beyond, end, found), np.where(beyond, 0.0, speeds)
