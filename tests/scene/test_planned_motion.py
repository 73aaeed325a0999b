"""Motions of one's own: hand-computed triggers, paths and speeds."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from augment.errors import InvalidDocument, InvalidModification
from augment.scene.codec import (
    modification_from_document,
    modification_to_document,
    scene_to_document,
)
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.motion import MotionSource, Movement, find_motion
from augment.scene.planned_motion import (
    AtPlace,
    AtTime,
    LanePath,
    NearEgo,
    PlannedMotion,
    PointPath,
)
from augment.scene.planned_mover import check_motions, smooth_line
from tests.scenes import junction, lane, lanes, pedestrian, scene, vehicle


def two_lanes() -> Scene:
    """Lane1 under the ego, who drives at 8 m/s; Lane2 left of it, the same way."""
    return scene(lanes=lanes(0.0, 3.5, ends_m=(-50.0, 400.0)))


def with_motion(agent: TrafficAgent, motion: PlannedMotion, **parts: Any) -> TrafficAgent:
    return replace(agent, motion=motion, **{"speed_mps": 0.0, "lane_id": None} | parts)


def moved(base: Scene, agent: TrafficAgent) -> Movement:
    return find_motion(replace(base, agents=(agent,))).others[0]


def test_a_car_cuts_in_when_the_ego_is_15_m_away() -> None:
    # The ego is at 8 t, the car at (30 + 4 t, 3.5): they are 15 m apart once 30 - 4 t is
    # sqrt(15^2 - 3.5^2) = 14.586 m, at 3.854 s; it is seen at the next step, 3.9 s.
    motion = PlannedMotion(
        path=LanePath(lane_ids=("Lane2", "Lane1"), change_m=20.0), start=NearEgo(within_m=15.0)
    )
    car = with_motion(vehicle("Agent2", 30.0, 3.5), motion, speed_mps=4.0, lane_id="Lane2")
    cut_in = moved(two_lanes(), car)
    assert cut_in.source is MotionSource.PLANNED
    assert cut_in.started_s == pytest.approx(3.9)
    assert cut_in.states[:40, 1] == pytest.approx(3.5)
    x_m, y_m = cut_in.states[39, :2]
    assert (x_m, y_m) == pytest.approx((45.6, 3.5))

    def slope(share: float) -> float:
        return 3.5 / 20.0 * 30.0 * share**2 * (1.0 - share) ** 2

    halfway_m, _ = quad(lambda x: np.hypot(1.0, slope(x / 20.0)), 0.0, 10.0)
    across = np.interp(3.9 + halfway_m / 4.0, 0.1 * np.arange(151), cut_in.states[:, 1])
    assert across == pytest.approx(1.75, abs=0.01)
    done = round((3.9 + 2.0 * halfway_m / 4.0) / 0.1) + 1
    assert cut_in.states[done:, 1] == pytest.approx(0.0, abs=1e-9)
    assert cut_in.states[done:, 2] == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(*np.diff(cut_in.states[:, :2], axis=0).T) == pytest.approx(0.4, abs=0.002)


def test_a_leader_brakes_from_10_to_0_in_2_s() -> None:
    motion = PlannedMotion(speeds=((2.0, 0.0),), start=AtTime(after_s=1.05))
    car = with_motion(vehicle("Agent2", 20.0, 0.0), motion, speed_mps=10.0, lane_id="Lane1")
    braking = moved(two_lanes(), car)
    assert braking.started_s == 1.05
    # 10.5 m at 10 m/s, then 10 t - 2.5 t^2: 7.5 m in the first second, 10 m in all.
    assert braking.states[10, 0] == pytest.approx(30.0)
    assert braking.states[20, 0] == pytest.approx(30.5 + 9.5 * 0.95 - 2.5 * 0.95**2 + 0.5 * 0.95)
    assert braking.states[31:, 0] == pytest.approx(40.5)
    assert braking.states[[0, 31], 3].tolist() == [10.0, 0.0]


@pytest.mark.parametrize(
    ("start", "since_s"),
    [
        (NearEgo(within_m=20.0), 2.6),  # 40 - 8 t within sqrt(20^2 - 4^2) = 19.6 m at 2.55 s
        (AtPlace(x_m=24.0, y_m=0.0, within_m=0.01), 3.0),
        (AtPlace(x_m=24.0, y_m=4.0, within_m=0.5), None),
        (AtPlace(agent_id="Agent3", x_m=18.0, y_m=3.5, within_m=0.01), 2.0),
        (NearEgo(within_m=3.9), None),
    ],
)
def test_a_walker_runs_out_when_triggered(start: NearEgo | AtPlace, since_s: float | None) -> None:
    motion = PlannedMotion(
        path=PointPath(points_m=((40.0, 4.0),)), speeds=((0.0, 2.0),), start=start
    )
    walker = with_motion(pedestrian("Agent2", 40.0, -4.0), motion)
    other = vehicle("Agent3", 10.0, 3.5, speed_mps=4.0, lane_id="Lane2")
    walk = find_motion(replace(two_lanes(), agents=(walker, other))).others[0]
    assert walk.started_s == (None if since_s is None else pytest.approx(since_s))
    if since_s is not None:
        steps = round(since_s / 0.1) + np.array([0, 10, 40, 60])
        assert walk.states[steps, 1] == pytest.approx([-4.0, -2.0, 4.0, 4.0])
        assert walk.states[steps[-1], 3] == 0.0
    else:
        assert (walk.states == walk.states[0]).all()


def test_a_door_slides_without_turning() -> None:
    path = PointPath(points_m=((10.0, -1.0),), keeps_heading=True)
    motion = PlannedMotion(path=path, speeds=((0.0, 1.0),))
    door = moved(two_lanes(), with_motion(vehicle("Agent2", 10.0, -2.0, 0.3), motion))
    assert door.states[[0, 5, 10, 20], 1] == pytest.approx([-2.0, -1.5, -1.0, -1.0])
    assert set(door.states[:, 2]) == {0.3}


def test_a_path_follows_lanes_through_a_junction_and_is_gone_past_the_map() -> None:
    motion = PlannedMotion(path=LanePath(lane_ids=("Lane1", "Connector2", "Lane3")))
    car = with_motion(vehicle("Agent2", 0.0, 0.0), motion, speed_mps=10.0, lane_id="Lane1")
    turning = moved(junction(), car)
    arc_m = 8.0 * np.pi / 2.0
    assert turning.states[40, :2] == pytest.approx((28.0, 8.0 + 40.0 - 20.0 - arc_m), abs=0.05)
    assert np.flatnonzero(~turning.is_present)[0] == np.ceil((20.0 + arc_m + 52.0) / 1.0)


def test_at_the_end_of_a_path_one_stands_at_a_point_and_leaves_past_lanes() -> None:
    stops = PlannedMotion(path=PointPath(points_m=((38.0, 0.0),)), start=AtTime(after_s=1.0))
    car = with_motion(vehicle("Agent2", 30.0, 0.0), stops, speed_mps=8.0, lane_id="Lane1")
    assert moved(two_lanes(), car).states[[9, 10, 60], 0] == pytest.approx([37.2, 38.0, 38.0])
    leaves = PlannedMotion(path=LanePath(lane_ids=("Lane1",)))
    car = with_motion(vehicle("Agent2", 400.0, 0.0), leaves)
    assert moved(two_lanes(), car).is_present.all()
    assert moved(two_lanes(), replace(car, speed_mps=1.0)).is_present.nonzero()[0].tolist() == [0]


@pytest.mark.parametrize(
    ("motion", "sentence"),
    [
        (PlannedMotion(path=LanePath(lane_ids=("Lane9",))), "Lane9 is no lane of the scene"),
        (PlannedMotion(path=LanePath(lane_ids=("Lane3", "Lane2"))),
         "Agent2: a path over lanes: Lane2 neither follows Lane3 nor runs beside it"),
        (PlannedMotion(start=AtPlace(agent_id="Agent2", x_m=0.0, y_m=0.0)),
         "it waits for Agent2, who is none of Agent1"),
    ],
)  # fmt: skip
def test_what_cannot_be_carried_out_is_refused(motion: PlannedMotion, sentence: str) -> None:
    car = with_motion(vehicle("Agent2", 0.0, 0.0), motion)
    with pytest.raises(InvalidModification, match=sentence):
        check_motions(junction(), Modification(added=(car,)))
    with pytest.raises(InvalidDocument, match=f"agents: .*{sentence}"):
        scene_to_document(replace(junction(), agents=(car,)))


def test_paths_without_an_end_and_rings_of_lanes_are_bounded() -> None:
    corners = tuple((1e5 * (-1) ** n, 1e5 * (-1) ** (n // 2)) for n in range(200))
    wanders = PlannedMotion(path=PointPath(points_m=corners))
    car = with_motion(vehicle("Agent2", 0.0, 3.5), wanders, speed_mps=9.0)
    assert moved(two_lanes(), car).is_present.all()
    # Two lanes of 1 mm that follow each other: one time around, and the car is past the map.
    ring = (
        lane("Lane1", [(0.0, 0.0), (0.001, 0.0)], successors=("Lane2",)),
        lane("Lane2", [(0.001, 0.0), (0.0, 0.0)], successors=("Lane1",)),
    )
    circles = PlannedMotion(path=LanePath(lane_ids=("Lane1", "Lane2") * 10))
    goes_round = with_motion(vehicle("Agent2", 0.0, 0.0), circles, speed_mps=9.0, lane_id="Lane1")
    around = moved(replace(two_lanes(), lanes=ring), goes_round)
    assert np.flatnonzero(around.is_present).tolist() == [0]
    crowd = tuple(replace(goes_round, id=f"Agent{n}") for n in range(2, 103))
    with pytest.raises(InvalidModification, match="101 agents have a motion; at most 100"):
        check_motions(junction(), Modification(added=crowd))


def test_a_slope_of_next_to_nothing_is_none() -> None:
    line = smooth_line([(0.0, 0.0), (1.0, 1e-310), (2.0, 1.0)])
    assert line.position(0.5) == pytest.approx((0.5, 0.0))


def test_a_motion_is_written_and_read_and_a_walk_beside_it_is_refused() -> None:
    motion = PlannedMotion(
        path=PointPath(points_m=((40.0, 4.0),)),
        speeds=((0.0, 2.0), (1.5, 0.0)),
        start=AtPlace(agent_id="Agent3", x_m=1.0, y_m=2.0),
    )
    walker = with_motion(pedestrian("Agent2", 40.0, -4.0), motion)
    change = Modification(added=(walker,))
    document = modification_to_document(change)
    assert modification_from_document(document) == change
    document["add"][0]["walk_to_m"] = [1.0, 2.0]
    with pytest.raises(InvalidDocument, match="a walk or a motion, not both"):
        modification_from_document(document)
    del document["add"][0]["walk_to_m"]
    document["add"][0]["motion"]["speeds"][1][0] = 0.0
    with pytest.raises(InvalidDocument, match="0 s does not follow 0 s"):
        modification_from_document(document)


def test_a_motion_is_told_in_words() -> None:
    for motion, words in (
        (PlannedMotion(), "sets out at once"),
        (
            PlannedMotion(
                path=LanePath(lane_ids=("Lane2", "Lane1")),
                speeds=((0.0, 12.0), (2.5, 7.0)),
                start=AtTime(after_s=2.0),
            ),
            "sets out after 2 s, along Lane2, Lane1, 12 m/s after 0 s, 7 m/s after 2.5 s",
        ),
        (
            PlannedMotion(
                path=PointPath(points_m=tuple((float(x), -1.0) for x in range(6))),
                start=NearEgo(within_m=15.0),
            ),
            "sets out when the ego is within 15 m, through (0.0, -1.0), (1.0, -1.0), (2.0, -1.0), "
            "(3.0, -1.0) and 2 more",
        ),
        (
            PlannedMotion(start=AtPlace(agent_id="Agent3", x_m=1.0, y_m=2.5)),
            "sets out when Agent3 is within 2 m of (1, 2.5)",
        ),
    ):
        assert str(motion) == words
