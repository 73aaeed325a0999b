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
from augment.variants.showing import count_calls
from tests.fixtures.shelf import entry, shown_scene
from tests.intents import known
from tests.variants.playing import MemoryTranscript, play

SLUG = "overtake-terrace-row"


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


def roles_asked(variant: str, character: Character) -> list[ModelRole]:
    task = EditTask(scene=shown_scene(SLUG), instruction=entry(SLUG).instruction)
    transcript, modifier = (
        MemoryTranscript(),
        RespondentClient(client=Playing(character), model="m"),
    )
    play(RECIPES[variant], task, modifier, transcript)
    return [call.role for call in transcript.calls]


@pytest.mark.parametrize("variant", ["otm", "fc", "tqa", "vqa", "fc-plus", "geo", "fc+tqa"])
@pytest.mark.parametrize("character", [GOOD, STUBBORN, LOOPING], ids=["good", "stubborn", "loop"])
def test_no_run_asks_less_or_more_often_than_said(variant: str, character: Character) -> None:
    least, _, most = count_calls(RECIPES[variant])
    asked = roles_asked(variant, character)
    assert set(asked) <= set(RECIPES[variant].roles)
    assert least <= len(asked) <= most


def test_the_calls_of_the_papers_variants() -> None:
    assert count_calls(OTM) == (1, 1, 2)
    # Eight calls, the ninth that is refused, the answer and its re-ask.
    assert count_calls(FC) == (1, 2, 11)
    # Three rounds of two roles, each asked twice.
    assert count_calls(TQA) == (2, 2, 6 + 6)
    # The engineer is asked two questions in each.
    assert count_calls(VQA) == (4, 4, 6 + 12 + 6)
