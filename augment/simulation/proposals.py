"""PDM-Closed's proposals: IDM policies of several speeds, rolled out on parallel paths.

P paths, V policies; proposal number p * V + v. Source: the facts on PDM-Closed in
docs/simulation.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from augment.simulation.pdm_closed import STEPS_A_SLICE, Corridor
from augment.simulation.states import STEP_S, EgoBody, FloatArray
from augment.simulation.traffic import PROPOSAL_IDM

ORIGINAL_OFFSETS_M = (0.0, -1.0, 1.0)
"""The centreline first: of equal scores, all zero among them, the lowest number wins."""
PAPER_OFFSETS_M = (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0)
"""The paper says up to 4 m; steps of 1 m and their order are our reading."""
SPEED_SHARES = (0.2, 0.4, 0.6, 0.8, 1.0)
HORIZON_STEPS = 40
WHOLE_STEPS = 80
FALLBACK_LIMIT_MPS = 15.0


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
        first: The step that the start belongs to.
        last: Where to end.
    """
    shape = (len(start_m), len(targets_mps))
    station = np.repeat(start_m[:, None], shape[1], axis=1)
    speed = np.full(shape, max(speed_mps, 0.0))
    targets = np.broadcast_to(targets_mps, shape)
    reach = float(targets_mps.max()) * WHOLE_STEPS * STEP_S
    stations = np.empty((last - first + 1, *shape))
    stations[0] = station
    near, leader = np.zeros(shape), np.zeros(shape)
    for step in range(first, last):
        if step % STEPS_A_SLICE == 0:
            near, leader = _leaders(station, corridor, step // STEPS_A_SLICE, ends_m, reach, body)
        gap = near - station - body.front_m
        pull = PROPOSAL_IDM.clipped(speed, targets, gap, leader)
        station = station + speed * STEP_S
        speed = np.maximum(speed + pull * STEP_S, 0.0)
        stations[step + 1 - first] = station
    return Rollout(stations_m=np.moveaxis(stations, 0, -1), speeds_mps=speed)


def _leaders(
    station: FloatArray,
    corridor: Corridor,
    moment: int,
    ends_m: FloatArray,
    reach: float,
    body: EgoBody,
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
    nearest = np.take_along_axis(rear, which[..., None], axis=-1)[..., 0]
    speeds = corridor.speeds_mps[moment][which]
    beyond = nearest >= end
    return np.where(beyond, end, nearest), np.where(beyond, 0.0, speeds)
