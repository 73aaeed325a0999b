"""No ordinary final answer is mistaken for a call, and no call for a final answer."""

import random

import pytest

from augment.fake_llm.playing import CARELESS, GOOD
from augment.llm.client import Patience
from augment.prompts.blocks import names_changes
from augment.prompts.calls import calls_in
from augment.variants.pipeline import run
from augment.variants.recipes import find_recipe
from augment.variants.respondents import RespondentClient
from bench.mutated_answers import Answering
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.prompts.test_calls import FORMS
from tests.variants.memory import MemoryTranscript


def answers(slug: str, variant: str, character: object) -> list[str]:
    """What the stand-in says to the modifier, in order."""
    transcript = MemoryTranscript()
    run(
        find_recipe(variant),
        scene=shown_scene(slug),
        instruction=entry(slug).instruction,
        modifier=RespondentClient(client=Answering(character, 10**9, random.Random(0)), model="m"),  # type: ignore[arg-type]
        transcript=transcript,
        patience=Patience(sleep=lambda _: None, rng=random.Random(0)),
    )
    return [call.reply.text for call in transcript.calls if call.reply is not None]


@pytest.mark.parametrize("slug", SLUGS)
def test_of_all_answers_on_the_catalogue_only_those_without_a_block_call(slug: str) -> None:
    for answer in answers(slug, "fc", GOOD):
        calls = calls_in(answer)
        assert bool(calls) is not names_changes(answer)
        assert not any(call.mended or call.problem for call in calls)
        if not calls:
            told = answer.replace("Modified Vectors", " ".join(FORMS.values()) + "\n\nModified V")
            assert calls_in(told) == ()
    for answer in answers(slug, "otm", CARELESS):
        assert calls_in(answer) == ()
