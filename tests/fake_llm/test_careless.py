import math
import random
from collections import Counter
from dataclasses import replace

import pytest

from augment.fake_llm.careless import MISTAKES, bend, dice, is_unreadable, lay_straight, misread
from augment.scene.entities import Modification, Scene, TrafficAgent, TurnType
from augment.scene.intent import Intent
from tests.fixtures.shelf import SLUGS, entry, shown_scene
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


def intent_of(slug: str) -> Intent:
    intent = entry(slug).intent
    assert intent is not None
    return intent


def heard(slug: str) -> list[Intent]:
    return [misread(intent_of(slug), random.Random(seed)) for seed in range(20)]


def test_on_the_paper_set_nothing_is_misread() -> None:
    """But for distances from another object of the same wish, which its ten roadworks have."""
    anchored = [s for s in SLUGS if any(one.spot.anchor for one in intent_of(s).requests)]
    plain = [slug for slug in SLUGS if slug not in anchored]
    assert len(plain) == 40
    assert all(set(heard(slug)) == {intent_of(slug)} for slug in plain)
    for slug in SLUGS[::5]:
        assert lay_straight(shown_scene(slug), entry(slug).reference) == entry(slug).reference


@pytest.mark.parametrize("slug", ["windmill-circle-first-exit", "orchard-circle-third-exit"])
def test_a_turn_is_passed_over_or_taken_the_other_way(slug: str) -> None:
    routes = {one.route for one in heard(slug)}
    assert TurnType.STRAIGHT in routes
    assert len(routes) == 3  # straight, the other way, and right but counted from the ego


def test_what_can_t_be_met_is_done_anyway_at_times() -> None:
    assert {bool(one.unmet) for one in heard("hairpin-hill-no-bus")} == {True, False}
