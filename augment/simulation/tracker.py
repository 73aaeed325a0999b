"""nuPlan's tracker: an LQR that follows a row of poses on a kinematic bicycle.

The speed and the curvature of the poses are fitted by regularised least squares. Both fits are
nuPlan's, solved for the profile itself instead of its first value and its rates: the speed's
normal matrix then holds no heading and is one constant.
The bicycle moves about the rear axle; its pedals and its wheel lag. Shapes: (T, B), the moments
first, because the tracker walks along them.
"""

import math
from functools import lru_cache

import numpy as np

from augment.simulation import shapes
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
)

MAX_STEERING_RAD = math.pi / 3.0
# First-order lags of 0.2 s and 0.05 s over one step, dt / (dt + tau).
_PEDAL = STEP_S / (STEP_S + 0.2)
_WHEEL = STEP_S / (STEP_S + 0.05)
# Weights of the least squares of nuPlan's reference velocities and curvatures.
JERK_PENALTY = 1e-4
"""On the squared difference of neighbouring accelerations."""
CURVATURE_RATE_PENALTY = 1e-2
FIRST_CURVATURE_PENALTY = 1e-10

# Steps of 0.1 s that the tracker looks ahead; the horizon itself, _B_S, in seconds.
HORIZON = 10
SPEED_WEIGHT, SPEED_COST = 10.0, 1.0
LATERAL_WEIGHT, HEADING_WEIGHT, STEERING_RATE_COST = 1.0, 10.0, 1.0
STOPPING_SPEED_MPS = 0.2
# 1/s: acceleration for each m/s that is missing.
STOPPING_GAIN = 0.5
_B_S = HORIZON * STEP_S
# One-step LQR of v' = v + B a: the least q (v + B a - w)^2 + r a^2 is at
# a = B q (w - v) / (B q B + r).
_SPEED_GAIN = _B_S * SPEED_WEIGHT / (_B_S * SPEED_WEIGHT * _B_S + SPEED_COST)


def track(references: FloatArray, start: FloatArray, body: EgoBody) -> FloatArray:
    """Return the states (B, T, 6) of following references (B, T, 3) from one start (6,)."""
    states = drive_steps(references, start, body, references.shape[1] - 1)
    states[..., HEADING] = shapes.wrap_angles(states[..., HEADING])
    return states


def drive_steps(
    references: FloatArray, start: FloatArray, body: EgoBody, steps: int
) -> FloatArray:
    """Return the first steps along references (B, T, 3), T >= 2, as (B, steps + 1, 6).

    The headings are not wrapped.
    """
    # (T, B, 3): a step reads one block of memory.
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
    # The commanded angle is rate * dt further on; the lag lets a share of that happen.
    turned = steering + (_WHEEL * STEP_S) * steering_rate_radps
    following[STEERING] = turned.clip(-MAX_STEERING_RAD, MAX_STEERING_RAD)
    return following


def speeds(poses: FloatArray) -> FloatArray:
    """Return the speed profile (T-1, B) of poses (T, B, 3)."""
    steps = np.diff(poses[..., :2], axis=0)
    heading = poses[:-1, :, HEADING]
    # (T - 1, B): each step's part along the heading at its beginning.
    advances = np.cos(heading) * steps[..., X] + np.sin(heading) * steps[..., Y]
    return np.asarray(_speed_fit(len(advances)) @ advances, dtype=np.float64)


@lru_cache(maxsize=16)
def _speed_fit(count: int) -> FloatArray:
    """The matrix (N, N) from advances along the heading to speeds."""
    # (N - 2, N): differences of neighbouring accelerations (v[i + 1] - v[i]) / dt.
    second = np.diff(np.eye(count), n=2, axis=0) / STEP_S
    # Least |dt v - advances|^2 + penalty |second v|^2.
    normal = STEP_S**2 * np.eye(count) + JERK_PENALTY * second.T @ second
    return np.asarray(np.linalg.inv(normal) * STEP_S, dtype=np.float64)


def curvatures(poses: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the curvature profile (T-1, B) of poses (T, B, 3), given their speeds (T-1, B)."""
    way = speed * STEP_S
    rates = np.diff(np.eye(len(way)), axis=0) / STEP_S
    penalty = CURVATURE_RATE_PENALTY * rates.T @ rates
    penalty[0, 0] += FIRST_CURVATURE_PENALTY
    # (B, T - 1, T - 1): turn = curvature * way in each step; standing ones rest on the penalty.
    normal = penalty + np.eye(len(way)) * (way.T**2)[:, :, None]
    right = way * shapes.wrap_angles(np.diff(poses[..., HEADING], axis=0))
    # B systems against (B, T - 1, 1), the moments first again.
    return np.asarray(np.linalg.solve(normal, right.T[:, :, None])[:, :, 0].T, dtype=np.float64)


class _Plan:
    """Part of the references that does not depend on the states, by step."""

    def __init__(self, poses: FloatArray, steps: int) -> None:
        speed = speeds(poses)
        last = len(speed) - 1
        # (steps, HORIZON): the profile that each step looks at; past its end the last value.
        ahead = np.minimum(np.arange(steps)[:, None] + np.arange(HORIZON), last)
        self._bends = curvatures(poses, speed)[ahead]
        self._wanted = speed[np.minimum(np.arange(steps) + HORIZON, last)]
        self._poses = np.ascontiguousarray(poses[:steps].transpose(0, 2, 1))

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
        """The rate (B,) that is best over the horizon, in which the errors go on by themselves."""
        pose, bends = self._poses[step], self._bends[step]
        cos, sin = np.cos(pose[HEADING]), np.sin(pose[HEADING])
        # (B,) left of the reference pose.
        lateral = cos * (state[Y] - pose[Y]) - sin * (state[X] - pose[X])
        heading = shapes.wrap_angles(state[HEADING] - pose[HEADING])
        # The errors, and how they answer to a steering rate of 1 rad/s.
        by_lateral, by_heading = np.zeros(lateral.shape), np.zeros(lateral.shape)
        for ahead in range(HORIZON):
            # Small angles: a step leads way * heading to the left and turns by way * curvature.
            way = (state[SPEED] + pedals * (ahead * STEP_S)) * STEP_S
            lateral = lateral + way * heading
            by_lateral += way * by_heading
            heading = heading + way * (state[STEERING] / wheelbase_m - bends[ahead])
            by_heading += way * (ahead * STEP_S / wheelbase_m)
        # Of both errors at the end: the least sum of q (error + by rate)^2 + r rate^2 is at
        # rate = -sum q by error / (sum q by^2 + r).
        gain = LATERAL_WEIGHT * by_lateral * lateral
        gain += HEADING_WEIGHT * by_heading * shapes.wrap_angles(heading)
        cost = LATERAL_WEIGHT * by_lateral**2 + HEADING_WEIGHT * by_heading**2
        return np.asarray(-gain / (cost + STEERING_RATE_COST), dtype=np.float64)
