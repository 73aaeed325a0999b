import math
import random
from collections import Counter
from dataclasses import replace

import pytest

from augment.fake_llm.careless import MISTAKES, MOTION_MISTAKES, bend, dice, is_unreadable
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.planned_motion import AtTime, LanePath, NearEgo, PlannedMotion, PointPath
from augment.scene.planned_mover import check_motions
from tests.scenes import curve, junction, pedestrian, scene, vehicle

PARKED = vehicle("Agent2", 21.4, 0.6, lane_id="Lane1")
ROUND_THE_BEND = vehicle("Agent2", 10.0 + 40.0 * math.sin(0.7), 9.4, 0.7, lane_id="Lane1")


def drawn(shown: Scene, *right: TrafficAgent) -> dict[str, Modification]:
    """One modification of each mistake that comes up in 300 draws."""
    bent = [bend(shown, Modification(added=right), random.Random(n)) for n in range(300)]
    return {mistake: modification for modification, mistake in bent}


@pytest.mark.slow
def test_only_mistakes_that_make_a_difference_are_made() -> None:
    assert set(drawn(scene(), PARKED)) == {"none", "neighbour-lane", "wrong-side", "distance"}
    crash = drawn(scene(), PARKED, replace(PARKED, id="Agent3", x_m=25.0, heading_rad=0.5))
    assert "heap" in crash
    bend_mistakes = set(drawn(curve(), ROUND_THE_BEND))
    assert {"straight-line", "ego-heading", "distance"} <= bend_mistakes
    walker = pedestrian("Agent2", 18.0, -5.0, (18.0, 6.0))
    assert "facing-away" in drawn(scene(), walker)
    assert {name for made in (scene(), curve()) for name in drawn(made, PARKED)} <= {
        *MISTAKES,
        "none",
    }


def test_a_mistake_is_what_its_name_says() -> None:
    made = drawn(scene(), PARKED)
    (far,) = made["distance"].added
    assert 3.4 < abs(far.x_m - 21.4) < 13.6
    (beside,) = made["neighbour-lane"].added
    assert abs(beside.y_m - 0.6) == pytest.approx(3.5)
    (mirrored,) = made["wrong-side"].added
    assert mirrored.y_m == pytest.approx(-0.6)
    (about,) = made["none"].added
    assert abs(about.x_m - 21.4) <= 1.5
    (straight,) = drawn(curve(), ROUND_THE_BEND)["straight-line"].added
    assert straight.y_m < 1.0
    (askew,) = drawn(curve(), ROUND_THE_BEND)["ego-heading"].added
    assert abs(askew.heading_rad) < 0.1


def test_about_one_answer_in_ten_can_not_be_read() -> None:
    fallen = Counter(is_unreadable(dice(f"prompt {n}")) for n in range(2000))
    assert 0.07 < fallen[True] / 2000 < 0.13


TURNING = LanePath(lane_ids=("Lane1", "Connector2", "Lane3"))
BRAKES = PlannedMotion(path=TURNING, speeds=((2.0, 4.0),), start=NearEgo(within_m=20.0))
LEADER = replace(PARKED, x_m=12.0, y_m=0.0, speed_mps=8.0, motion=BRAKES)
OUT = PlannedMotion(path=PointPath(points_m=((18.0, 6.0),)), speeds=((0.0, 2.0),))


def motions(agent: TrafficAgent) -> dict[str, PlannedMotion]:
    """The motion after each mistake in it that comes up."""
    changes = drawn(junction(), agent)
    return {
        name: change.added[0].motion
        for name, change in changes.items()
        if name in MOTION_MISTAKES and change.added[0].motion is not None
    }


def test_a_mistake_in_a_motion_is_what_its_name_says() -> None:
    made = motions(LEADER)
    assert made.keys() == MOTION_MISTAKES.keys()
    assert isinstance(made["wrong-trigger"].start, AtTime)
    late = made["late-start"].start
    assert isinstance(late, NearEgo)
    assert 6.0 <= late.within_m <= 10.0
    assert made["wrong-speed"].speeds in (((2.0, 2.0),), ((2.0, 6.4),))
    assert made["wrong-deceleration"].speeds in (((0.8, 4.0),), ((5.0, 4.0),))
    assert made["wrong-way"].path == LanePath(lane_ids=("Lane1", "Connector1"))
    runner = pedestrian("Agent2", 18.0, -5.0, motion=OUT)
    made = motions(runner)
    assert made.keys() == MOTION_MISTAKES.keys() - {
        "wrong-deceleration"
    }  # it has its speed at once
    later = made["late-start"].start
    assert isinstance(later, AtTime)
    assert 2.0 <= later.after_s <= 4.0
    path = made["wrong-way"].path
    assert isinstance(path, PointPath)
    assert abs(path.points_m[0][0] - 18.0) == pytest.approx(3.5, abs=1.5)


def test_a_motion_goes_along_and_leaves_the_share_of_right_answers_as_it_is() -> None:
    walker = pedestrian("Agent2", 18.0, -5.0, (18.0, 6.0))
    runner = replace(walker, walk_to_m=None, motion=OUT)
    for one in (walker, runner):
        throws = [dice(f"prompt {n}") for n in range(400)]
        names = [bend(junction(), Modification(added=(one,)), throw)[1] for throw in throws]
        assert Counter(names)["none"] / 400 == pytest.approx(0.25, abs=0.06)
    (far,) = drawn(junction(), runner)["distance"].added
    assert isinstance(far.motion.path, PointPath)
    (end_m,) = far.motion.path.points_m
    assert (end_m[0] - far.x_m, end_m[1] - far.y_m) == pytest.approx((0.0, 11.0))


def test_every_mistake_in_a_motion_can_still_be_read() -> None:
    for n in range(100):
        change, _ = bend(junction(), Modification(added=(LEADER,)), random.Random(n))
        check_motions(junction(), change)
        assert modification_from_document(modification_to_document(change)) == change
