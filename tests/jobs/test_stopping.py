"""A worker that is told to stop: what was asked is awaited, nothing else is asked."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from celery.exceptions import Reject
from django.conf import settings

from augment import tasks
from augment.errors import WorkerStopping
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.endpoints.client import Queue, place_at
from augment.services.running import runner, workers
from tests.jobs.models import Model, Wire, llama_job, reply
from tests.jobs.rows import launch, only_row
from tests.variants.answers import GOOD

pytestmark = pytest.mark.django_db
State = Augmentation.State


@pytest.fixture(autouse=True)
def _going_on() -> Iterator[None]:
    workers.withdraw_stop()
    yield
    workers.withdraw_stop()


def only(job: GenerationJob) -> tuple[Augmentation, list[ModelCall]]:
    row = only_row(job)
    calls = ModelCall.objects.filter(attempt__augmentation=row).order_by("pk")
    return row, list(calls)


def test_no_row_is_claimed_any_more_and_its_message_goes_back() -> None:
    row = only_row(launch())
    workers.request_stop()
    with pytest.raises(Reject) as caught:
        tasks.work.run("augmentation", row.pk)
    assert caught.value.requeue
    row.refresh_from_db()
    assert row.state == State.QUEUED
    assert not row.attempts.exists()


def test_where_nothing_was_sent_the_row_goes_back_unpaid() -> None:
    job = llama_job()
    assert runner.work_on(
        augmentation_pk=only_row(job).pk, connect=Model(waiting=workers.request_stop)
    )
    row, calls = only(job)
    assert (row.state, row.sent_at, row.claim) == (State.QUEUED, None, None)
    assert [(call.sent_at, call.spent_tokens) for call in calls] == [(None, 0)]
    job.refresh_from_db()
    assert (job.spent_calls, job.reserved_calls, job.reserved_tokens) == (0, 0, 0)
    assert row.attempts.get().outcome == "released"


def test_an_answer_before_the_stop_is_not_asked_for_again() -> None:
    """It can't be read, so the model is asked once more: by whoever takes the row next."""
    job = llama_job()
    unreadable = Model(lambda _: reply("no answer at all"), looking_on=workers.request_stop)
    assert runner.work_on(augmentation_pk=only_row(job).pk, connect=unreadable)
    row, calls = only(job)
    assert row.state == State.QUEUED
    assert len(calls) == 1
    workers.withdraw_stop()
    assert runner.work_on(augmentation_pk=row.pk, connect=Wire(GOOD))
    row, calls = only(job)
    assert row.state == State.DONE
    assert [call.served_from_id is not None for call in calls] == [False, True, False]
    job.refresh_from_db()
    assert job.spent_calls == 2


def test_who_waits_for_a_place_gives_up_the_wait() -> None:
    endpoint = llama_job().contestants.get().endpoint
    assert endpoint is not None
    endpoint.max_concurrency = 1
    endpoint.save()
    looks: list[float] = []

    def sleep(seconds: float) -> None:
        looks.append(seconds)
        workers.request_stop()

    queue = Queue(longest_s=600.0, still_wanted=workers.insist_on_going_on, sleep=sleep)
    with (
        place_at(endpoint, Queue(longest_s=settings.LLM_QUEUE_S)),
        pytest.raises(WorkerStopping),
        place_at(endpoint, queue),
    ):
        pytest.fail("two have one place")
    assert len(looks) == 1
