"""Every form of a call goes through a job, to an endpoint over HTTP and back."""

from __future__ import annotations

import json

import pytest

from augment.models import Augmentation, ModelCall, TranscriptNote
from tests.jobs.scripted import CAR, Scripted, add, run
from tests.llm.json_server import serving
from tests.prompts.test_calls import FORMS, MALFORMED

pytestmark = pytest.mark.django_db


def run_with(said: str) -> tuple[Augmentation, list[dict[str, object]], str]:
    """The row of an FC contestant that says this first; its calls; what it was sent after it."""
    with serving(Scripted()) as server:
        add(server, "calls", "fc")
        server.script = [said, CAR]
        (row,) = run("calls")
        notes = TranscriptNote.objects.filter(attempt__augmentation=row, kind="tool_call")
        sent = json.dumps(server.bodies[1]["messages"][-1])
    assert ModelCall.objects.filter(attempt__augmentation=row).count() == 2
    return row, [note.document for note in notes], sent


@pytest.mark.parametrize("written", FORMS.values(), ids=FORMS)
def test_a_call_in_another_form_is_answered_and_counted_as_mended(written: str) -> None:
    row, calls, _ = run_with(written)
    assert row.state == Augmentation.State.DONE
    assert [(call["understood"], call["mended"]) for call in calls] == [(True, True)]


@pytest.mark.parametrize(("written", "problem"), MALFORMED)
def test_a_call_that_can_not_be_understood_goes_back_with_its_reason(
    written: str, problem: str
) -> None:
    row, calls, sent = run_with(written)
    assert row.state == Augmentation.State.DONE
    assert [call["understood"] for call in calls] == [False]
    assert problem in json.loads(sent)["content"]
    assert '"error"' in json.loads(sent)["content"]
    assert "keep your placement" not in sent
