"""A request that was answered before is answered from the store, unless it is to be asked anew."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import pytest
from django.core.files.storage import default_storage
from django.utils import timezone

from augment.errors import ModelFault
from augment.llm.messages import Message, Reply, Request, Speaker, ToolCall
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.running import answers, jobs, runner
from augment.services.running.transcripts import RowTranscript
from augment.variants.transcript import ModelRole, NoteKind
from tests.jobs.models import Model, llama_job, reply
from tests.jobs.rows import leased, only_row
from tests.variants.answers import GOOD

pytestmark = pytest.mark.django_db

DONE = Augmentation.State.DONE


def again(*, is_fresh: bool = False) -> GenerationJob:
    return jobs.launch(
        name="Again", contestants=["llama"], scenarios=["street-1"], is_fresh=is_fresh
    )


def ran(job: GenerationJob, model: Model) -> Augmentation:
    row = only_row(job)
    runner.work_on(augmentation_pk=row.pk, connect=model)
    row.refresh_from_db()
    return row


def test_the_same_request_is_answered_once_and_the_copy_costs_nothing() -> None:
    model = Model()
    first = ran(llama_job(price="1"), model)
    job = again()
    second = ran(job, model)
    assert (second.state, second.modification) == (DONE, first.modification)
    assert len(model.requests) == 1
    source, copy = ModelCall.objects.order_by("pk")
    assert (copy.served_from, copy.answer, copy.request) == (source, source.answer, source.request)
    assert (copy.cost_nano_usd, copy.spent_tokens, copy.latency_s) == (0, 0, None)
    assert (copy.model_returned, copy.is_cached) == ("llama3.1-2407", True)
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_nano_usd) == (0, 0)


def test_a_copy_of_a_copy_names_the_call_that_was_paid_for() -> None:
    model = Model()
    ran(llama_job(), model)
    ran(again(), model)
    ran(again(), model)
    source = ModelCall.objects.get(served_from=None)
    assert source.copies.count() == 2


def test_a_fresh_job_asks_anew() -> None:
    model = Model()
    ran(llama_job(), model)
    ran(again(is_fresh=True), model)
    assert len(model.requests) == 2
    assert not ModelCall.objects.exclude(served_from=None).exists()


def test_a_fault_is_no_answer() -> None:
    broken = Model(ModelFault("no", retryable=False, status=500))
    job = llama_job()
    ran(job, broken)
    jobs.retry_failed(job)
    model = Model()
    assert ran(job, model).state == DONE
    assert len(model.requests) == 1


def test_a_refusal_is_an_answer_and_stays_one() -> None:
    model = Model(lambda request: Reply(text="", refusal="I would rather not."))
    ran(llama_job(), model)
    row = ran(again(), model)
    assert (row.state, row.reason) == (Augmentation.State.REFUSED, "I would rather not.")
    assert len(model.requests) == 1


def test_an_image_is_kept_once_in_the_media_and_named_in_the_request() -> None:
    row = only_row(llama_job())
    assert row.contestant.endpoint is not None
    transcript = RowTranscript(leased(row, now=timezone.now()), row, row.contestant.endpoint)
    message = Message(speaker=Speaker.USER, text="Look.", images=(b"a picture",))
    transcript.asked(ModelRole.VIEWER, Request(model="m", messages=(message,)), "p1")
    digest = hashlib.sha256(b"a picture").hexdigest()
    call = ModelCall.objects.get()
    assert call.request["messages"][0]["content"][1]["image_url"]["url"] == f"sha256:{digest}"
    with default_storage.open(f"asked/{digest}.png") as kept:
        assert kept.read() == b"a picture"


def test_notes_are_kept_in_their_order_between_calls() -> None:
    row = only_row(llama_job())
    assert row.contestant.endpoint is not None
    held = leased(row, now=timezone.now())
    transcript = RowTranscript(held, row, row.contestant.endpoint)
    transcript.note(NoteKind.ROUND, {"round": 1})
    message = Message(speaker=Speaker.USER, text="Go.")
    transcript.asked(ModelRole.MODIFIER, Request(model="m", messages=(message,)), "p1")
    transcript.note(NoteKind.REVIEW, {"mean": 4.5, "said": "nul \0"})
    notes = row.attempts.get().notes.values_list("after_call", "kind", "document")
    assert list(notes) == [
        (0, "round", {"round": 1}),
        (1, "review", {"mean": 4.5, "said": "nul ␀"}),
    ]


def test_an_answer_to_a_cut_prompt_is_kept_and_paid_for_but_never_served() -> None:
    cut = Model(lambda request: replace(reply(), prompt_tokens=12))
    job = llama_job(price="1")
    assert "silently cut" in ran(job, cut).reason
    call = ModelCall.objects.get()
    assert (call.answer, call.prompt_tokens) == (GOOD, 12)
    assert "silently cut" in call.fault
    job.refresh_from_db()
    assert job.spent_tokens > 0
    whole = Model()
    assert ran(again(), whole).state == DONE
    assert len(whole.requests) == 1


def test_what_a_model_wants_called_is_part_of_its_answer() -> None:
    wanted = ToolCall(id="c1", name="pose_on_lane", arguments='{"lane": "Lane1"')
    columns = answers.columns_of(replace(reply(), tool_calls=(wanted,)))
    assert answers.reply_of(ModelCall(**columns)).tool_calls == (wanted,)
    assert answers.columns_of(reply())["extras"] is None
