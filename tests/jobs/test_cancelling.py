"""A cancelled job frees the places of its calls in flight; what was paid for is counted, kept."""

import sqlite3
from datetime import timedelta
from typing import Any

import pytest
from django.db import OperationalError
from django.utils import timezone

from augment.errors import JobCancelled
from augment.llm.messages import Message, Request, Speaker
from augment.llm.openai_wire import OpenAIWire
from augment.models import Augmentation, CallLease, Endpoint, GenerationJob, ModelCall
from augment.services.endpoints.client import Queue, place_at
from augment.services.running import budget, calls, jobs, runner
from augment.services.running.runner import AUGMENTATIONS
from augment.services.work import Lease
from tests.jobs.models import Model, Wire, llama_job, ran, reply
from tests.jobs.rows import only_row
from tests.llm.raw_server import drip, head, speaking
from tests.variants.playing import GOOD

pytestmark = pytest.mark.django_db
State = Augmentation.State
ASKED = Request(model="m", messages=(Message(speaker=Speaker.USER, text="Hello"),))


def cancel() -> None:
    jobs.cancel(GenerationJob.objects.get())


def test_a_call_in_flight_frees_its_place_with_its_job(monkeypatch: pytest.MonkeyPatch) -> None:
    job = llama_job(price="2")
    looks: list[int] = []

    def wire_to(endpoint: Endpoint, *, still_wanted: Any) -> Any:
        def look() -> None:
            if server.heard and not looks:
                looks.append(1)
                assert CallLease.objects.filter(finished_at=None).count() == 1
                cancel()
            still_wanted()

        return OpenAIWire(
            base_url=endpoint.base_url,
            api_key=None,
            timeout_s=60.0,
            still_wanted=look,
            look_every_s=0.01,
        )

    monkeypatch.setattr(runner, "wire_to", wire_to)
    with speaking(drip(head("Content-Length: 100000"), b" ")) as server:
        Endpoint.objects.update(base_url=server.url)
        row = only_row(job)
        assert runner.AUGMENTATIONS.perform(row.pk)
    row.refresh_from_db()
    job.refresh_from_db()
    assert (row.state, row.reason) == (State.CANCELLED, "The job was cancelled.")
    assert row.attempts.get().outcome == "cancelled"
    assert CallLease.objects.get().finished_at is not None
    call = ModelCall.objects.get()
    assert call.fault == "given up before there was an answer: The job was cancelled."
    assert call.sent_at is not None
    assert (call.spent_tokens, call.is_cost_estimated) == (call.reserved_tokens, True)
    assert (job.reserved_calls, job.spent_calls, job.reserved_nano_usd) == (0, 1, 0)


def test_a_call_that_waits_when_its_job_is_cancelled_is_not_sent() -> None:
    job = llama_job()
    row = only_row(job)
    held = AUGMENTATIONS.take(row.pk)
    endpoint = Endpoint.objects.get()
    Endpoint.objects.update(max_concurrency=1)
    client = runner.open_wire(endpoint, held)
    jobs.cancel(job)
    with place_at(endpoint, Queue(longest_s=0.0)), client as opened, pytest.raises(JobCancelled):
        opened.complete(ASKED)
    assert CallLease.objects.count() == 1


# --- A locked database -------------------------------------------------------------------------


def locked(times: int, function: Any) -> Any:
    """The function, that finds the database locked so many times first."""
    left = [times]

    def called(*given: Any, **named: Any) -> Any:
        if left[0] > 0:
            left[0] -= 1
            raise OperationalError("database is locked")
        return function(*given, **named)

    return called


def test_an_answer_waits_for_a_locked_database_and_is_kept(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(budget, "settle", locked(3, budget.settle))
    row = ran(only_row(llama_job()), Wire(reply(GOOD)))
    assert row.state == State.DONE
    assert ModelCall.objects.get().answer == GOOD
    assert caplog.text.count("database is locked") == 3


def test_a_place_that_can_not_be_given_back_costs_no_answer(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    llama_job()
    endpoint = Endpoint.objects.get()
    calls: list[int] = []

    def clock() -> Any:
        calls.append(1)
        if len(calls) > 1:
            raise OperationalError("database is locked")
        return timezone.now()

    with place_at(endpoint, Queue(longest_s=0.0, clock=clock, renew_every_s=60.0)):
        answer = "Hi"
    assert answer == "Hi"
    assert "runs out by itself" in caplog.text
    lease = CallLease.objects.get()
    assert lease.finished_at is None
    assert lease.expires_at < timezone.now() + timedelta(seconds=61)


@pytest.mark.parametrize(
    ("owner", "name"),
    [
        (runner.Augmentations, "take"),
        (budget, "reserve"),
        (calls.CallTranscript, "sending"),
        (runner, "draw_picture"),
        (Lease, "settle"),
        (jobs, "finish_if_over"),
    ],
)
def test_a_lock_is_waited_out_and_is_never_an_outcome(
    monkeypatch: pytest.MonkeyPatch, owner: Any, name: str
) -> None:
    job = llama_job()
    monkeypatch.setattr(owner, name, locked(2, getattr(owner, name)))
    model = Model()
    row = ran(only_row(job), model)
    job.refresh_from_db()
    assert (row.state, row.reason) == (State.DONE, "")
    assert len(model.requests) == 1
    assert job.state == GenerationJob.State.FINISHED
    assert {one.outcome for one in row.attempts.all()} <= {"done", "released"}
    assert not ModelCall.objects.filter(settled_at=None).exists()


def test_a_wrong_statement_is_no_lock(monkeypatch: pytest.MonkeyPatch) -> None:
    def break_down(*_: object) -> None:
        cause = sqlite3.OperationalError()
        cause.sqlite_errorcode = sqlite3.SQLITE_ERROR
        raise OperationalError("no such column") from cause

    monkeypatch.setattr(runner, "draw_picture", break_down)
    assert ran(only_row(llama_job()), Model()).reason.startswith("unexpected: ")
