"""nuPlan's tracker: an LQR that follows a row of poses on a kinematic bicycle.

The speed and the curvature of the poses are fitted by regularised least squares. Both fits are
nuPlan's, solved for the profile itself instead of its first value and its rates: the speed's
normal matrix then holds no heading and is one constant, and the curvature's has three diagonals.
The bicycle moves about the rear axle; its pedals and its wheel lag. Shapes: (T, B), the moments
first, because the tracker walks along them.
"""

import math
from functools import lru_cache

import numpy as np

from augment.simulation.states import (
    ACCELERATION,
    HEADING,
    SPEED,
    STEERING,
    STEP_S,
    WIDTH,
    EgoBody,
    FloatArray,
    X,
    Y,
    wrap_angles,
)

MAX_STEERING_RAD = math.pi / 3.0
_PEDAL = STEP_S / (STEP_S + 0.2)
_WHEEL = STEP_S / (STEP_S + 0.05)
JERK_PENALTY = 1e-4
"""On the squared difference of neighbouring accelerations."""
CURVATURE_RATE_PENALTY = 1e-2
FIRST_CURVATURE_PENALTY = 1e-10

HORIZON = 10
SPEED_WEIGHT, SPEED_COST = 10.0, 1.0
LATERAL_WEIGHT, HEADING_WEIGHT, STEERING_RATE_COST = 1.0, 10.0, 1.0
STOPPING_SPEED_MPS = 0.2
STOPPING_GAIN = 0.5
_B_S = HORIZON * STEP_S
_SPEED_GAIN = _B_S * SPEED_WEIGHT / (_B_S * SPEED_WEIGHT * _B_S + SPEED_COST)


def track(references: FloatArray, start: FloatArray, body: EgoBody) -> FloatArray:
    """Return the states (B, T, 6) of following references (B, T, 3) from one start (6,)."""
    states = drive_steps(references, start, body, references.shape[1] - 1)
    states[..., HEADING] = wrap_angles(states[..., HEADING])
    return states


def drive_steps(
    references: FloatArray, start: FloatArray, body: EgoBody, steps: int
) -> FloatArray:
    """Return the first steps along references (B, T, 3), T >= 2, as (B, steps + 1, 6).

    The headings are not wrapped.
    """
    poses = np.ascontiguousarray(references.transpose(1, 0, 2))
    plan = _Plan(poses, steps)
    states = np.empty((steps + 1, WIDTH, poses.shape[1]))
    states[0] = start[:, None]
    for step in range(steps):
        pedals, wheel = plan.commands(step, states[step], body.wheelbase_m)
        states[step + 1] = advance(states[step], pedals, wheel, body.wheelbase_m)
    return np.ascontiguousarray(states.transpose(2, 0, 1))


def advance(
    state: FloatArray,
    acceleration_mps2: FloatArray,
    steering_rate_radps: FloatArray,
    wheelbase_m: float,
) -> FloatArray:
    """Return states (6, B) one step later: the place by the old speed and the old steering.

    Args:
        state: (6, B), the numbers first.
        acceleration_mps2: The command (B,); the pedals follow with a lag of 0.2 s.
        steering_rate_radps: The command (B,); the wheel follows with a lag of 0.05 s.
        wheelbase_m: Between the axles.
    """
    following = np.empty_like(state)
    way = state[SPEED] * STEP_S
    heading, steering = state[HEADING], state[STEERING]
    following[X] = state[X] + way * np.cos(heading)
    following[Y] = state[Y] + way * np.sin(heading)
    following[HEADING] = heading + way * np.tan(steering) / wheelbase_m
    gained = state[ACCELERATION] + _PEDAL * (acceleration_mps2 - state[ACCELERATION])
    following[ACCELERATION] = gained
    following[SPEED] = state[SPEED] + gained * STEP_S
    turned = steering + (_WHEEL * STEP_S) * steering_rate_radps
    following[STEERING] = turned.clip(-MAX_STEERING_RAD, MAX_STEERING_RAD)
    return following


def speeds(poses: FloatArray) -> FloatArray:
    """Return the speed profile (T-1, B) of poses (T, B, 3)."""
    steps = np.diff(poses[..., :2], axis=0)
    heading = poses[:-1, :, HEADING]
    advances = np.cos(heading) * steps[..., X] + np.sin(heading) * steps[..., Y]
    return np.asarray(_speed_fit(len(advances)) @ advances, dtype=np.float64)


@lru_cache(maxsize=16)
def _speed_fit(count: int) -> FloatArray:
    """The matrix (N, N) from advances along the heading to speeds."""
    second = np.diff(np.eye(count), n=2, axis=0) / STEP_S
    normal = STEP_S**2 * np.eye(count) + JERK_PENALTY * second.T @ second
    return np.asarray(np.linalg.inv(normal) * STEP_S, dtype=np.float64)


def curvatures(poses: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the curvature profile (T-1, B) of poses (T, B, 3), given their speeds (T-1, B).

    The symmetric systems of three diagonals are solved for all columns at once.
    """
    way = speed * STEP_S
    right = way * wrap_angles(np.diff(poses[..., HEADING], axis=0))
    off = -CURVATURE_RATE_PENALTY / STEP_S**2
    diagonal = way**2 - 2.0 * off
    diagonal[0] += FIRST_CURVATURE_PENALTY + off
    diagonal[-1] += off
    upper, solved = np.empty_like(diagonal), np.empty_like(right)
    upper[0] = off / diagonal[0]
    solved[0] = right[0] / diagonal[0]
    for row in range(1, len(diagonal)):
        pivot = 1.0 / (diagonal[row] - off * upper[row - 1])
        upper[row] = off * pivot
        solved[row] = (right[row] - off * solved[row - 1]) * pivot
    for row in range(len(diagonal) - 2, -1, -1):
        solved[row] -= upper[row] * solved[row + 1]
    return solved


def _sums() -> tuple[FloatArray, FloatArray]:
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
    once = np.array([speed.sum(), gain.sum(), 0.0])
    once_j = np.array([(speed * steps).sum(), (gain * steps).sum(), 0.0])
    plain = np.array([once, squares.sum(axis=1), once_j, (squares * steps).sum(axis=1)])
    return plain, np.vstack([speed, gain, squares])


_PLAIN, _BENDS = _sums()


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
        pedals = np.where(stopping, STOPPING_GAIN, _SPEED_GAIN) * (wanted - speed)
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
