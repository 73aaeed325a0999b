"""What checks find is said whole in German: every kind of finding on broken and wrong changes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace

import pytest
from django.utils import translation

from augment.baselines.broken import break_reference
from augment.checks import Finding, FindingKind, Ground
from augment.checks.against_intent import check_against_intent
from augment.scene.intent_codec import intent_from_document
from augment.services.wording import translate
from tests.checks.worlds import FIXTURES, references

ENGLISH = re.compile(
    r"\b(is|are|the|asked|of|left|right|ahead|behind|from|which|degrees|there|moves|a|to|on)\b"
)


@pytest.fixture(scope="module")
def found() -> list[Finding]:
    """Of references that stand on the ego, of one another's places, turned and too fast."""
    return list(_found())


def _found() -> Iterator[Finding]:
    known = references()[::2]
    for one, other in zip(known, known[1:] + known[:1], strict=True):
        document = json.loads((FIXTURES / "scenarios" / f"{one.slug}.json").read_text())
        intent, ground = intent_from_document(document["intent"]), Ground.of(one.scene)
        right, others = one.modification, other.modification.added
        turned = tuple(
            replace(
                agent, y_m=-agent.y_m - 0.3, heading_rad=agent.heading_rad + 2.2, speed_mps=40.0
            )
            for agent in right.added
        )
        far = tuple(replace(agent, x_m=agent.x_m + 300.0, width_m=9.0) for agent in right.added)
        for change in (
            break_reference(right),
            replace(right, added=turned),
            replace(right, added=far),
            replace(right, added=(*right.added, replace(right.added[0], id="Twin"))),
            replace(right, added=tuple(replace(agent, id=f"{agent.id}b") for agent in others)),
            replace(right, removed=tuple(agent.id for agent in one.scene.agents[:1])),
        ):
            assert change is not None
            yield from check_against_intent(ground, change, intent)


def test_every_sentence_of_a_check_has_its_german(found: list[Finding]) -> None:
    english = {one.sentence() for one in found}
    with translation.override("de"):
        said = {one.sentence(dict.fromkeys(one.lanes, "L"), say=translate) for one in found}
    assert said.isdisjoint(english)
    assert [text for text in said if ENGLISH.search(text.replace("Agent", ""))] == []


def test_these_changes_are_found_fault_with_in_nearly_every_way(found: list[Finding]) -> None:
    assert set(FindingKind) - {one.kind for one in found} <= {
        FindingKind.LANE_NAMED,
        FindingKind.DEGREES,
        FindingKind.ASKED_CROSSING,
    }
