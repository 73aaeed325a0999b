"""The rule placer on the sentences of the committed catalogue that its grammar understands.

The others it has to refuse. Some sentences were written with the grammar in sight, so this shows
that nothing broke, not how well it reads free text: docs/catalogue.md has that number."""

from __future__ import annotations

import pytest

from augment.baselines.rule_placer import place
from augment.errors import InstructionNotUnderstood
from augment.scene.catalogue import ScenarioType
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.modification import apply
from tests.fixtures.shelf import SLUGS, entry, measure_agent, shown_scene


def of_type(agents: tuple[TrafficAgent, ...], kind: AgentType) -> list[TrafficAgent]:
    return [agent for agent in agents if agent.type is kind]


def is_placed(slug: str) -> bool:
    try:
        place(shown_scene(slug), entry(slug).instruction)
    except InstructionNotUnderstood:
        return False
    return True


PLACED = [slug for slug in SLUGS if is_placed(slug)]


def test_two_thirds_are_placed_some_of_every_type() -> None:
    assert len(PLACED) >= 32
    assert {entry(slug).type for slug in PLACED} == set(ScenarioType)


@pytest.mark.parametrize("slug", PLACED)
def test_what_is_understood_is_placed_beside_its_reference(slug: str) -> None:
    reference = entry(slug).reference
    assert reference is not None
    placement = place(shown_scene(slug), entry(slug).instruction)
    apply(shown_scene(slug), placement.modification)
    made = placement.modification.added
    assert [agent.type for agent in made] == [agent.type for agent in reference.added]
    for kind in {agent.type for agent in made} - {AgentType.PEDESTRIAN}:
        pairs = zip(of_type(made, kind), of_type(reference.added, kind), strict=True)
        for number, (agent, wanted) in enumerate(pairs):
            if number > 0 and entry(slug).type is ScenarioType.ACCIDENT_SITE:
                continue  # the sentence leaves open where the others stand
            here, there = measure_agent(slug, agent), measure_agent(slug, wanted)
            assert here.ahead_m == pytest.approx(there.ahead_m, abs=1.5)
            assert here.left_m == pytest.approx(there.left_m, abs=1.5)


@pytest.mark.parametrize("slug", [slug for slug in PLACED if slug.startswith("jaywalker")])
def test_walks_begin_and_end_beside_those_of_the_reference(slug: str) -> None:
    reference = entry(slug).reference
    assert reference is not None
    walkers = place(shown_scene(slug), entry(slug).instruction).modification.added
    for walker, wanted in zip(walkers, reference.added, strict=True):
        assert walker.walk_to_m is not None
        assert wanted.walk_to_m is not None
        assert (walker.x_m, walker.y_m) == pytest.approx((wanted.x_m, wanted.y_m), abs=1.5)
        assert walker.walk_to_m == pytest.approx(wanted.walk_to_m, abs=1.5)
