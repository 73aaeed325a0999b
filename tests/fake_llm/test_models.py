"""Every model of the stand-in through the wire and along the recipe: what becomes of it."""

from __future__ import annotations

import pytest

from augment.errors import ContextTruncated, ModelFault
from augment.fake_llm.server import MODELS, running
from augment.variants.respondents import MemoryTranscript
from tests.fake_llm.asking import outcome
from tests.intents import intents
from tests.scenes import scene

WISH = "Add a parked vehicle 21.4 m ahead of the ego in its lane."
KEY = "sk-planted-4f7a9c0d1e2b3a"

OUTCOMES = {
    "fake-good": ("done", 1),
    "fake-qa-low": ("done", 1),
    "fake-qa-never": ("done", 1),
    "fake-qa-nonnumeric": ("done", 1),
    "fake-tool-loop": ("done", 1),
    "fake-unknown-tool": ("done", 1),
    "fake-bad-tool-args": ("done", 1),
    "fake-garbage": ("unreadable", 2),
    "fake-no-vision": ("done", 1),
    "fake-cuts-context": ("fault", 1),
    "fake-500-then-ok": ("done", 2),
    "fake-no-usage": ("done", 1),
    "fake-refuse": ("refused", 1),
    "fake-filtered": ("refused", 1),
    "fake-prose": ("unreadable", 2),
    "fake-cut-off": ("unreadable", 2),
    "fake-nan": ("unreadable", 2),
    "fake-too-few": ("unreadable", 2),
    "fake-500": ("fault", 3),
    "fake-429": ("fault", 3),
    "fake-429-long": ("fault", 1),
    "fake-quota": ("fault", 1),
    "fake-context": ("fault", 1),
    "fake-list-error": ("fault", 1),
    "fake-html": ("fault", 1),
    "fake-slow": ("fault", 3),
    "fake-broken-json": ("fault", 3),
    "fake-dropped": ("fault", 3),
    "fake-no-choices": ("fault", 3),
    "fake-null-choices": ("fault", 3),
}


def test_every_model_but_the_careless_has_an_outcome_of_its_own() -> None:
    assert OUTCOMES.keys() | {"fake-careless"} == MODELS.keys()


@pytest.mark.parametrize("model", OUTCOMES)
def test_each_model_comes_to_its_outcome_in_so_many_calls(model: str) -> None:
    wanted, calls = OUTCOMES[model]
    transcript = MemoryTranscript()
    with running(slow_s=30.0, intents=intents) as server:
        try:
            made = outcome(
                server,
                model,
                scene(),
                WISH,
                transcript=transcript,
                key=KEY,
                timeout_s=0.5 if model == "fake-slow" else 60.0,
            )
            status, shown = made.status.value, repr(made)
        except ModelFault as fault:
            status, shown = "fault", repr(fault) + repr(vars(fault))
    assert (status, len(transcript.calls)) == (wanted, calls)
    if model == "fake-cuts-context":
        assert isinstance(transcript.calls[0].fault, ContextTruncated)
    else:
        assert all((call.reply is None) != (call.fault is None) for call in transcript.calls)
    assert KEY not in shown + repr(transcript.calls)
