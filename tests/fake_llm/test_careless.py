import math
import random
from collections import Counter
from dataclasses import replace

import pytest

from augment.fake_llm.careless import MISTAKES, bend, dice, is_unreadable
from augment.scene.entities import Modification, Scene, TrafficAgent
from tests.scenes import curve, pedestrian, scene, vehicle

PARKED = replace(vehicle("Agent2", 21.4, 0.6), lane_id="Lane1")
ROUND_THE_BEND = replace(vehicle("Agent2", 10.0 + 40.0 * math.sin(0.7), 9.4, 0.7), lane_id="Lane1")


def drawn(shown: Scene, *right: TrafficAgent) -> dict[str, Modification]:
    """One modification of each mistake that comes up in 300 draws."""
    bent = [bend(shown, Modification(added=right), random.Random(n)) for n in range(300)]
    return {mistake: modification for modification, mistake in bent}


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
