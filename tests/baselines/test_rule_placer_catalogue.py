"""The rule placer on the authored intents of the committed catalogue."""

from __future__ import annotations

from functools import cache

import pytest

from augment.baselines.rule_placer import Placement, place
from augment.checks import Ground, Severity
from augment.checks.registry import check_against_intent
from augment.scene.entities import AgentType, ScenarioType, TrafficAgent, apply
from tests.fixtures.shelf import SLUGS, entry, measure_agent, shown_scene


def of_type(agents: tuple[TrafficAgent, ...], kind: AgentType) -> list[TrafficAgent]:
    return [agent for agent in agents if agent.type is kind]


@cache
def placed(slug: str) -> Placement:
    """What the rule placer makes of a scenario, worked out once."""
    return place(shown_scene(slug), entry(slug).intent)


def test_every_scenario_of_the_catalogue_is_placed() -> None:
    assert [slug for slug in SLUGS if placed(slug).modification.is_empty] == []


@pytest.mark.parametrize("slug", SLUGS)
def test_the_checks_find_nothing_in_a_placement(slug: str) -> None:
    scene = shown_scene(slug)
    found = check_against_intent(Ground.of(scene), placed(slug).modification, entry(slug).intent)
    assert [one.sentence() for one in found if one.severity is not Severity.FACT] == []


@pytest.mark.parametrize("slug", SLUGS)
def test_what_is_asked_for_is_placed_beside_its_reference(slug: str) -> None:
    reference = entry(slug).reference
    assert reference is not None
    placement = placed(slug)
    apply(shown_scene(slug), placement.modification)
    made = placement.modification.added
    assert [agent.type for agent in made] == [agent.type for agent in reference.added]
    for kind in {agent.type for agent in made} - {AgentType.PEDESTRIAN}:
        pairs = zip(of_type(made, kind), of_type(reference.added, kind), strict=True)
        for number, (agent, wanted) in enumerate(pairs):
            if number > 0 and entry(slug).type is ScenarioType.ACCIDENT_SITE:
                continue  # the intent leaves open where the others stand
            here, there = measure_agent(slug, agent), measure_agent(slug, wanted)
            assert here.ahead_m == pytest.approx(there.ahead_m, abs=1.5)
            assert here.left_m == pytest.approx(there.left_m, abs=1.5)


@pytest.mark.parametrize("slug", [slug for slug in SLUGS if slug.startswith("jaywalker")])
def test_walks_begin_and_end_beside_those_of_the_reference(slug: str) -> None:
    reference = entry(slug).reference
    assert reference is not None
    pairs = zip(
        of_type(placed(slug).modification.added, AgentType.PEDESTRIAN),
        of_type(reference.added, AgentType.PEDESTRIAN),
        strict=True,
    )
    for walker, wanted in pairs:
        assert walker.walk_to_m is not None
        assert wanted.walk_to_m is not None
        assert (walker.x_m, walker.y_m) == pytest.approx((wanted.x_m, wanted.y_m), abs=1.5)
        assert walker.walk_to_m == pytest.approx(wanted.walk_to_m, abs=2.0)
