"""A key that every door is knocked on with is found nowhere afterwards."""

import json
import logging
from collections.abc import Iterator

import pytest
from django.apps import apps
from django.conf import LazySettings
from django.urls import reverse

from augment.models import Augmentation, Endpoint, ModelCall
from augment.services.running import runner
from augment.services.running.transcript_records import full_transcript
from tests.jobs.models import llama_job
from tests.jobs.rows import only_row
from tests.llm.json_server import recorder
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

KEY = "sk-planted-0123456789abcdef"
ECHO = {
    "id": KEY,
    "object": "chat.completion",
    "created": 0,
    "model": f"m {KEY}",
    "choices": [
        {
            "index": 0,
            "finish_reason": KEY,
            "message": {"role": "assistant", "content": f"You sent Bearer {KEY}."},
        }
    ],
    "usage": {"prompt_tokens": 1, "completion_tokens": 1, "total_tokens": 2},
}
REFUSED = {"error": {"message": f"Incorrect API key provided: {KEY}", "code": KEY}}


def every_stored_value() -> Iterator[str]:
    """All columns of all rows of all tables, as text."""
    for model in apps.get_models(include_auto_created=True):
        for row in model._default_manager.values():
            yield f"{model.__name__} {row}"


@pytest.mark.parametrize(("status", "body"), [(200, ECHO), (401, REFUSED)])
def test_a_planted_key_is_found_nowhere(
    settings: LazySettings,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    status: int,
    body: object,
) -> None:
    monkeypatch.setenv("PLANTED_API_KEY", KEY)
    settings.KEY_VARIABLES = ["PLANTED_API_KEY=127.0.0.1"]
    caplog.set_level(logging.DEBUG)
    row = only_row(llama_job())
    with recorder(status, body) as server:
        Endpoint.objects.update(base_url=server.url, key_variable="PLANTED_API_KEY")
        runner.AUGMENTATIONS.perform(row.pk, worker="w")
        assert server.heard[0]["authorization"] == f"Bearer {KEY}", "it was planted"
    row.refresh_from_db()
    assert row.state in (Augmentation.State.UNREADABLE, Augmentation.State.FAILED)
    assert ModelCall.objects.exists()

    staff = signed_in(people()["admin"])
    pages = [
        staff.get(reverse(name, args=[code])).content.decode()
        for name, code in (
            ("augmentation", row.code),
            ("transcript", row.code),
            ("job", row.job.code),
        )
    ]
    kept = [*every_stored_value(), caplog.text, json.dumps(full_transcript(row)), *pages]
    assert [text[:200] for text in kept if KEY in text] == []
    assert any("[key]" in text for text in kept), "the server did echo it"
