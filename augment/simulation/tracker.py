"""The LQR that turns a row of poses into pedals and wheel, all proposals at once.

Source: nuPlan's two-stage controller. Both controllers look 10 steps ahead with one constant
input. The lateral error's way over these steps is linear in the input, and its coefficients are
polynomials in speed and acceleration; their constants are summed up once, when this is imported.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from augment.simulation import bicycle
from augment.simulation.profiles import curvatures, speeds
from augment.simulation.states import (
    HEADING,
    SPEED,
    STEERING,
    STEP_S,
    WIDTH,
    EgoBody,
    FloatArray,
    X,
    Y,
    state_of,
    wrap_angles,
)

HORIZON = 10
SPEED_WEIGHT, SPEED_COST = 10.0, 1.0
LATERAL_WEIGHT, HEADING_WEIGHT, STEERING_RATE_COST = 1.0, 10.0, 1.0
STOPPING_SPEED_MPS = 0.2
STOPPING_GAIN = 0.5

_B_S = HORIZON * STEP_S
_SPEED_GAIN = _B_S * SPEED_WEIGHT / (_B_S * SPEED_WEIGHT * _B_S + SPEED_COST)


def follow(reference: ArrayLike, start: ArrayLike, body: EgoBody | None = None) -> FloatArray:
    """Tracker and bicycle alone, along one reference.

    Args:
        reference: Rear-axle poses (T, 3) every 0.1 s: x_m, y_m, heading_rad; T >= 2.
        start: (x, y, heading, speed) of the rear axle, or a whole state (6,).
        body: nuPlan's vehicle when None.

    Returns:
        The states (T, 6), the start first (augment.simulation.states).

    Raises:
        ValueError: A shape is another one.
    """
    given = np.asarray(reference, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 3:
        raise ValueError(f"a reference has the shape (T, 3), not {given.shape}")
    states: FloatArray = track(given[None], state_of(start), body or EgoBody())[0]
    return states


def track(references: FloatArray, start: FloatArray, body: EgoBody) -> FloatArray:
    """The states (B, T, 6) of following references (B, T, 3) from one start (6,)."""
    made = drive_steps(references, start, body, references.shape[1] - 1)
    made[..., HEADING] = wrap_angles(made[..., HEADING])
    return made


def drive_steps(
    references: FloatArray, start: FloatArray, body: EgoBody, steps: int
) -> FloatArray:
    """The first `steps` steps along references (B, T, 3), as (B, steps + 1, 6); not wrapped."""
    if references.shape[1] < 2:
        raise ValueError("a reference needs two poses or more")
    poses = np.ascontiguousarray(references.transpose(1, 0, 2))
    plan = _Plan(poses, steps)
    states = np.empty((steps + 1, WIDTH, poses.shape[1]))
    states[0] = start[:, None]
    for step in range(steps):
        state = states[step]
        pedals, wheel = plan.commands(step, state, body.wheelbase_m)
        states[step + 1] = bicycle.advance(state, pedals, wheel, body.wheelbase_m)
    return np.ascontiguousarray(states.transpose(2, 0, 1))


# Private


def _sums() -> tuple[FloatArray, FloatArray, FloatArray]:
    """The constants of the horizon, from w_j = dt * v0 + dt^2 * j * a, in powers of v0 and a.

    Returns:
        plain (4, 3): sum w_j as (v0, a, 0), sum_k w_k sum_{j<k} w_j as (v0^2, v0 a, a^2),
        and both again with a factor j on w_j; bends (5, HORIZON): what a curvature at j adds to
        sum w_j k_j (v0, a) and to sum_k w_k sum_{j<k} w_j k_j (v0^2, v0 a, a^2).
    """
    steps = np.arange(HORIZON, dtype=np.float64)
    speed, gain = np.full(HORIZON, STEP_S), STEP_S**2 * steps
    after_speed = np.array([speed[j + 1 :].sum() for j in range(HORIZON)])
    after_gain = np.array([gain[j + 1 :].sum() for j in range(HORIZON)])
    squares = np.array(
        [speed * after_speed, speed * after_gain + gain * after_speed, gain * after_gain]
    )
    bends = np.vstack([speed, gain, squares])
    once = np.array([speed.sum(), gain.sum(), 0.0])
    once_j = np.array([(speed * steps).sum(), (gain * steps).sum(), 0.0])
    plain = np.array([once, squares.sum(axis=1), once_j, (squares * steps).sum(axis=1)])
    return plain, bends, steps


_PLAIN, _BENDS, _ = _sums()


class _Plan:
    """What of the references does not depend on the states, laid out by step."""

    def __init__(self, poses: FloatArray, steps: int) -> None:
        speed = speeds(poses)
        bend = curvatures(poses, speed)
        last = len(speed) - 1
        ahead = np.minimum(np.arange(steps)[:, None] + np.arange(HORIZON), last)
        self._bends = np.einsum("qj,tjb->tqb", _BENDS, bend[ahead])
        self._wanted = speed[np.minimum(np.arange(steps) + HORIZON, last)]
        here = poses[:steps]
        self._cos, self._sin = np.cos(here[..., HEADING]), np.sin(here[..., HEADING])
        self._poses = np.ascontiguousarray(here.transpose(0, 2, 1))

    def commands(
        self, step: int, state: FloatArray, wheelbase_m: float
    ) -> tuple[FloatArray, FloatArray]:
        """Acceleration and steering rate (B,) for states (6, B)."""
        speed, wanted = state[SPEED], self._wanted[step]
        stopping = (speed <= STOPPING_SPEED_MPS) & (wanted <= STOPPING_SPEED_MPS)
        missing = wanted - speed
        pedals = np.where(stopping, STOPPING_GAIN, _SPEED_GAIN) * missing
        rate = self._steering_rate(step, state, pedals, wheelbase_m)
        rate[stopping] = 0.0
        return pedals, rate

    def _steering_rate(
        self, step: int, state: FloatArray, pedals: FloatArray, wheelbase_m: float
    ) -> FloatArray:
        pose, bends = self._poses[step], self._bends[step]
        lateral = self._cos[step] * (state[Y] - pose[Y]) - self._sin[step] * (state[X] - pose[X])
        heading = wrap_angles(state[HEADING] - pose[HEADING])
        speed, steering = state[SPEED], state[STEERING] / wheelbase_m
        powers = np.stack([speed * speed, speed * pedals, pedals * pedals])
        once = _PLAIN[0, 0] * speed + _PLAIN[0, 1] * pedals
        twice = _PLAIN[1] @ powers
        bend_once = bends[0] * speed + bends[1] * pedals
        bend_twice = (bends[2:] * powers).sum(axis=0)
        free_lateral = lateral + heading * once + steering * twice - bend_twice
        free_heading = wrap_angles(heading + steering * once - bend_once)
        # The answer to a steering rate of 1 rad/s after the horizon.
        unit = STEP_S / wheelbase_m
        by_heading = unit * (_PLAIN[2, 0] * speed + _PLAIN[2, 1] * pedals)
        by_lateral = unit * (_PLAIN[3] @ powers)
        gain = LATERAL_WEIGHT * by_lateral * free_lateral
        gain += HEADING_WEIGHT * by_heading * free_heading
        cost = LATERAL_WEIGHT * by_lateral**2 + HEADING_WEIGHT * by_heading**2
        return np.asarray(-gain / (cost + STEERING_RATE_COST), dtype=np.float64)
