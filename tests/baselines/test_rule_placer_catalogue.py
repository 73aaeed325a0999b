"""The rule placer on the committed catalogue. Its grammar was written with these sentences in
sight, so this shows that nothing broke, not how well it reads free text."""

from __future__ import annotations

import pytest

from augment.baselines.rule_placer import place
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.modification import apply
from tests.fixtures.shelf import SLUGS, entry, measure_agent, shown_scene


def of_type(agents: tuple[TrafficAgent, ...], kind: AgentType) -> list[TrafficAgent]:
    return [agent for agent in agents if agent.type is kind]


@pytest.mark.parametrize("slug", SLUGS)
def test_every_sentence_is_understood_and_placed_beside_its_reference(slug: str) -> None:
    reference = entry(slug).reference
    assert reference is not None
    placement = place(shown_scene(slug), entry(slug).instruction)
    apply(shown_scene(slug), placement.modification)
    made = placement.modification.added
    assert [agent.type for agent in made] == [agent.type for agent in reference.added]
    for kind in {agent.type for agent in made} - {AgentType.PEDESTRIAN}:
        pairs = zip(of_type(made, kind), of_type(reference.added, kind), strict=True)
        for agent, wanted in pairs:
            here, there = measure_agent(slug, agent), measure_agent(slug, wanted)
            assert here.ahead_m == pytest.approx(there.ahead_m, abs=1.5)
            assert here.left_m == pytest.approx(there.left_m, abs=1.5)


@pytest.mark.parametrize("slug", [slug for slug in SLUGS if slug.startswith("jaywalker")])
def test_walks_begin_and_end_beside_those_of_the_reference(slug: str) -> None:
    reference = entry(slug).reference
    assert reference is not None
    (walker,) = place(shown_scene(slug), entry(slug).instruction).modification.added
    (wanted,) = of_type(reference.added, AgentType.PEDESTRIAN)
    assert walker.walk_to_m is not None
    assert wanted.walk_to_m is not None
    assert (walker.x_m, walker.y_m) == pytest.approx((wanted.x_m, wanted.y_m), abs=1.5)
    assert walker.walk_to_m == pytest.approx(wanted.walk_to_m, abs=1.5)
