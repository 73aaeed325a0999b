from __future__ import annotations

import random

import pytest

from augment.fake_llm.careless import lay_straight, misread
from augment.scene.entities import TurnType
from augment.scene.intent import Intent
from tests.fixtures.shelf import SLUGS, entry, shown_scene


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
