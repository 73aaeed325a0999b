"""No ordinary final answer is mistaken for a call, and no call for a final answer."""

import json
import random
from dataclasses import dataclass

import pytest

from augment.fake_llm.playing import CARELESS, GOOD, Character
from augment.fake_llm.wire import chat_request
from augment.llm.client import Patience, Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.prompts.blocks import names_changes
from augment.prompts.calls import calls_in
from augment.variants.pipeline import run
from augment.variants.recipes import find_recipe
from augment.variants.respondents import RespondentClient
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.intents import intents
from tests.prompts.test_calls import FORMS
from tests.variants.memory import MemoryTranscript


@dataclass(frozen=True)
class StandIn:
    """A client whose answers are the stand-in's, without a server."""

    character: Character

    def fitted(self, request: Request) -> Request:
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        body = json.dumps(request.to_document()).encode()
        text = self.character.answer(chat_request(body), intents)[0]
        return Reply(text=text, model="m", finish_reason="stop")


def answers(slug: str, variant: str, character: Character) -> list[str]:
    """What the stand-in says to the modifier, in order."""
    transcript = MemoryTranscript()
    run(
        find_recipe(variant),
        scene=shown_scene(slug),
        instruction=entry(slug).instruction,
        modifier=RespondentClient(client=StandIn(character), model="m"),
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
