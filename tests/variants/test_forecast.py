"""What a recipe is said to ask, beside what it asks."""

import json

import pytest

from augment.fake_llm.playing import GOOD, LOOPING, STUBBORN, Character
from augment.fake_llm.wire import chat_request
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.variants.pipeline import EditTask
from augment.variants.recipes import FC, OTM, RECIPES, TQA, VQA
from augment.variants.respondents import ModelRole, RespondentClient
from augment.variants.showing import CallRange, call_ranges
from tests.fixtures.shelf import entry, shown_scene
from tests.intents import known
from tests.variants.playing import MemoryTranscript, play

SLUG = "overtake-terrace-row"
MODIFIER, REVIEWER = ModelRole.MODIFIER, ModelRole.REVIEWER
ENGINEER, VIEWER = ModelRole.ENGINEER, ModelRole.VIEWER


class Playing:
    """Answers as a character of the stand-in."""

    def __init__(self, character: Character) -> None:
        self._character = character

    def fit(self, request: Request) -> Request:
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        sending()
        body = json.dumps(request.to_document()).encode()
        said, _ = self._character.answer(chat_request(body), known)
        return Reply(text=said, model="m", finish_reason="stop")


def calls_made(variant: str, character: Character) -> dict[ModelRole, int]:
    task = EditTask(scene=shown_scene(SLUG), instruction=entry(SLUG).instruction)
    transcript, modifier = (
        MemoryTranscript(),
        RespondentClient(client=Playing(character), model="m"),
    )
    play(RECIPES[variant], task, modifier, transcript)
    roles = [call.role for call in transcript.calls]
    return {role: roles.count(role) for role in dict.fromkeys(roles)}


@pytest.mark.parametrize("variant", ["otm", "fc", "tqa", "vqa", "fc-plus", "geo", "fc+tqa"])
@pytest.mark.parametrize("character", [GOOD, STUBBORN, LOOPING], ids=["good", "stubborn", "loop"])
def test_no_run_asks_less_or_more_often_than_said(variant: str, character: Character) -> None:
    said = call_ranges(RECIPES[variant])
    made = calls_made(variant, character)
    assert set(made) <= set(said)
    for role, count in made.items():
        assert said[role].least <= count <= said[role].most


def test_the_calls_of_the_papers_variants() -> None:
    one = CallRange(least=1, usual=1, most=2)
    assert call_ranges(OTM) == {MODIFIER: one}
    # Eight calls, the ninth that is refused, the answer and its re-ask.
    assert call_ranges(FC) == {MODIFIER: CallRange(least=1, usual=2, most=11)}
    three_rounds = CallRange(least=1, usual=1, most=6)
    assert call_ranges(TQA) == {MODIFIER: three_rounds, REVIEWER: three_rounds}
    twelve = CallRange(least=2, usual=2, most=12)
    assert call_ranges(VQA) == {MODIFIER: three_rounds, ENGINEER: twelve, VIEWER: three_rounds}
