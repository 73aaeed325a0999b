"""The tracker and the bicycle, held against closed forms and against the plain matrices."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from augment.simulation.path import Path, dense
from augment.simulation.shapes import corners, meet
from augment.simulation.states import EgoBody, FloatArray
from augment.simulation.tracker import track
from tests.properties import examples

BODY = EgoBody()
DT = 0.1


def straight(speed_mps: float, count: int = 41) -> FloatArray:
    made = np.zeros((count, 3))
    made[:, 0] = np.arange(count) * DT * speed_mps
    return made


def follow(reference: FloatArray, start: tuple[float, ...]) -> FloatArray:
    state = np.zeros(6)
    state[: len(start)] = start
    return np.asarray(track(reference[None], state, BODY)[0])


def bent(speed_mps: float, curvature: float, gain_mps2: float = 0.0) -> FloatArray:
    poses = [(0.0, 0.0, 0.0)]
    for _ in range(40):
        x, y, heading = poses[-1]
        way = speed_mps * DT
        poses.append(
            (x + way * math.cos(heading), y + way * math.sin(heading), heading + way * curvature)
        )
        speed_mps += gain_mps2 * DT
    return np.array(poses)


def test_at_walking_pace_the_stopping_controller_takes_half_the_missing_speed() -> None:
    slow = follow(straight(0.0), (0.0, 0.0, 0.0, 0.2))
    assert slow[1, 4] == pytest.approx(-0.5 * 0.2 / 3.0, rel=1e-6)
    faster = follow(straight(0.0), (0.0, 0.0, 0.0, 0.21))
    assert faster[1, 4] == pytest.approx(-10.0 / 11.0 * 0.21 / 3.0, rel=1e-6)


def test_the_steering_stops_at_its_limit() -> None:
    side = np.zeros((41, 3))
    side[:, 1] = np.arange(41) * 0.5
    side[:, 2] = math.pi / 2.0
    states = follow(side, (0.0, 0.0, -1.0, 5.0, 0.0, 1.0))
    assert np.abs(states[:, 5]).max() <= math.pi / 3.0


def test_all_proposals_at_once_are_what_the_plain_matrices_give_one_by_one() -> None:
    references = np.stack(
        [bent(4.0 + 0.3 * n, 0.03 * math.sin(n), 0.2 * math.cos(n)) for n in range(12)]
    )
    start = np.array([0.3, 0.5, 0.05, 6.0, 0.2, 0.01])
    states = track(references, start, BODY)
    for reference, made in zip(references, states, strict=True):
        assert made == pytest.approx(_by_matrices(reference, start), abs=1e-9)


def _by_matrices(poses: FloatArray, start: FloatArray) -> FloatArray:
    """The same controller, written down as least squares and as matrices of the horizon."""
    speed, bend = _profiles(poses)
    last = len(speed) - 1
    state, made = start.copy(), [start.copy()]
    for step in range(len(poses) - 1):
        pull = 10.0 * (speed[min(step + 10, last)] - state[3]) / 11.0
        x, y, heading = poses[step]
        error = np.array(
            [
                -(state[0] - x) * math.sin(heading) + (state[1] - y) * math.cos(heading),
                state[2] - heading,
                state[5],
            ]
        )
        answer = np.zeros(3)
        for ahead in range(10):
            v = state[3] + pull * ahead * DT
            matrix = np.eye(3)
            matrix[0, 1], matrix[1, 2] = v * DT, v * DT / BODY.wheelbase_m
            drift = np.array([0.0, -v * bend[min(step + ahead, last)] * DT, 0.0])
            error, answer = matrix @ error + drift, matrix @ answer + np.array([0.0, 0.0, DT])
        weights = np.diag([1.0, 10.0, 0.0])
        rate = -(answer @ weights @ error) / (answer @ weights @ answer + 1.0)
        following = state.copy()
        following[0] += state[3] * math.cos(state[2]) * DT
        following[1] += state[3] * math.sin(state[2]) * DT
        following[2] += state[3] * math.tan(state[5]) / BODY.wheelbase_m * DT
        following[4] = state[4] + DT / (DT + 0.2) * (pull - state[4])
        following[3] = state[3] + following[4] * DT
        following[5] = state[5] + DT / (DT + 0.05) * rate * DT
        state = following
        made.append(state.copy())
    return np.array(made)


def _profiles(poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First value and rates of both profiles, fitted with dense matrices."""
    steps, heading = np.diff(poses, axis=0), poses[:-1, 2]
    count = len(steps)
    sums = np.hstack([np.ones((count, 1)), DT * np.tril(np.ones((count, count)), -1)[:, :-1]])
    along = np.vstack([np.cos(heading)[:, None] * sums, np.sin(heading)[:, None] * sums]) * DT
    change = np.diff(np.eye(count - 1), axis=0)
    penalty = np.zeros((count, count))
    penalty[1:, 1:] = 1e-4 * change.T @ change
    right = np.concatenate([steps[:, 0], steps[:, 1]])
    speed = sums @ np.linalg.solve(along.T @ along + penalty, along.T @ right)
    turning = speed[:, None] * DT * sums
    penalty = 1e-2 * np.eye(count)
    penalty[0, 0] = 1e-10
    bend = sums @ np.linalg.solve(turning.T @ turning + penalty, turning.T @ steps[:, 2])
    return speed, bend


metres = st.floats(-8.0, 8.0)
angles = st.floats(-math.pi, math.pi)
sizes = st.floats(0.2, 6.0)
boxes = st.tuples(metres, metres, angles, sizes, sizes)


@examples(25)
@given(st.lists(st.tuples(boxes, boxes), min_size=1, max_size=20))
def test_boxes_meet_where_their_polygons_do(pairs: list[tuple[tuple[float, ...], ...]]) -> None:
    first, second = (np.array([pair[side] for pair in pairs]) for side in (0, 1))
    a, b = shapely.polygons(corners(first)), shapely.polygons(corners(second))
    clear = np.abs(shapely.distance(a, b) - 1e-9) > 1e-9  # nobody argues about rounding
    clear |= shapely.area(shapely.intersection(a, b)) > 1e-9
    assert (meet(first, second) == shapely.intersects(a, b))[clear].all()


@examples(25)
@given(st.integers(0, 2**32 - 1))
def test_places_beside_a_path_are_those_of_the_whole_line(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.cumsum(rng.uniform(-0.02, 0.02, 200))
    line = dense(np.cumsum(np.stack([np.cos(turn), np.sin(turn)], axis=1), axis=0))
    path = Path(line)
    inside = rng.uniform(5.0, path.length_m - 5.0, 50)
    aside = rng.uniform(-5.0, 5.0, 50)
    poses = path.poses(inside)
    points = poses[:, :2] + aside[:, None] * np.stack(
        [-np.sin(poses[:, 2]), np.cos(poses[:, 2])], axis=1
    )
    s_m, d_m = path.beside(points)
    whole = shapely.LineString(line)
    assert np.abs(d_m) == pytest.approx(shapely.distance(shapely.points(points), whole), abs=1e-9)
    assert s_m == pytest.approx(shapely.line_locate_point(whole, shapely.points(points)), abs=1e-6)
    assert (np.sign(d_m) == np.sign(aside))[np.abs(aside) > 0.05].all()
