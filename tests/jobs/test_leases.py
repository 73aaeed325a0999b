from __future__ import annotations

from datetime import timedelta

import pytest
from django.db import IntegrityError, transaction

from augment.models import Attempt, Augmentation, GenerationJob
from augment.services.running import jobs
from augment.services.running import jobs as retrying
from augment.services.running.runner import AUGMENTATIONS
from tests.jobs.rows import NOON, done, failed, launch, leased, only_row

pytestmark = pytest.mark.django_db
State = Augmentation.State
LATER = NOON + timedelta(seconds=30)


def test_a_waiting_row_can_be_claimed_once() -> None:
    row = only_row(launch())
    first = AUGMENTATIONS.take(row.pk, now=NOON, worker="w1")
    second = AUGMENTATIONS.take(row.pk, now=NOON, worker="w2")
    assert first is not None
    assert second is None
    row.refresh_from_db()
    assert (row.state, row.claim, row.heartbeat_at) == (State.RUNNING, first.token, NOON)
    attempt = row.attempts.get()
    assert (attempt.number, attempt.worker, attempt.started_at) == (1, "w1", NOON)


@pytest.mark.parametrize("state", [State.DONE, State.FAILED, State.CANCELLED, State.REFUSED])
def test_a_row_with_an_outcome_can_not_be_claimed(state: str) -> None:
    row = only_row(launch())
    Augmentation.objects.update(state=state, modification={}, image="bev/x.png")
    assert AUGMENTATIONS.take(row.pk, now=NOON) is None
    assert not Attempt.objects.exists()


@pytest.mark.parametrize(
    ("state", "is_started"),
    [
        (GenerationJob.State.RUNNING, True),
        (GenerationJob.State.STOPPED_AT_CAP, False),
        (GenerationJob.State.CANCELLED, False),
    ],
)
def test_a_row_of_a_job_that_stopped_is_not_started(state: str, is_started: bool) -> None:
    """Its message may come after the job has stopped: the row still waits by itself."""
    row = only_row(launch())
    GenerationJob.objects.update(state=state)
    held = AUGMENTATIONS.take(row.pk, now=NOON)
    assert (held is not None) == is_started
    row.refresh_from_db()
    assert row.state == (State.RUNNING if is_started else State.QUEUED)


def test_an_outcome_is_written_with_its_attempt() -> None:
    row = only_row(launch())
    held = leased(row)
    assert held.settle(done(), now=LATER)
    row.refresh_from_db()
    assert (row.state, row.image, row.finished_at) == (State.DONE, "bev/x.png", LATER)
    assert (row.claim, row.heartbeat_at) == (None, None)
    attempt = row.attempts.get()
    assert (attempt.outcome, attempt.finished_at) == ("done", LATER)


def test_a_claim_without_heartbeat_is_taken_back_and_its_attempt_is_lost() -> None:
    row = only_row(launch())
    AUGMENTATIONS.mark_sent([row.pk], now=NOON)
    leased(row)
    assert AUGMENTATIONS.take_back_lost(now=LATER) == [row.pk]
    row.refresh_from_db()
    assert (row.state, row.claim, row.sent_at) == (State.QUEUED, None, None)
    attempt = row.attempts.get()
    assert (attempt.outcome, attempt.finished_at) == ("lost", None)


def test_a_row_that_was_taken_back_gets_a_second_attempt() -> None:
    row = only_row(launch())
    leased(row)
    AUGMENTATIONS.take_back_lost(now=LATER)
    again = leased(row, now=LATER)
    assert row.attempts.count() == 2
    again.settle(done(), now=LATER)
    assert list(row.attempts.values_list("number", "outcome")) == [(1, "lost"), (2, "done")]


def test_a_stale_row_of_a_cancelled_job_is_cancelled() -> None:
    job = launch()
    leased(only_row(job))
    jobs.cancel(job)
    assert AUGMENTATIONS.take_back_lost(now=LATER) == []
    assert only_row(job).state == State.CANCELLED


def test_a_row_that_is_given_back_to_a_cancelled_job_is_cancelled() -> None:
    job = launch()
    row = only_row(job)
    held = leased(row)
    jobs.cancel(job)
    held.release(now=LATER)
    assert AUGMENTATIONS.take(row.pk, now=LATER) is None
    AUGMENTATIONS.tidy(LATER)
    assert only_row(job).state == State.CANCELLED


def test_workers_lost_before_an_outcome_are_forgiven() -> None:
    job = launch()
    row = only_row(job)
    for number in range(AUGMENTATIONS.lost_limit - 1):
        now = NOON + number * timedelta(minutes=1)
        leased(row, now=now)
        AUGMENTATIONS.take_back_lost(now=now + timedelta(seconds=30))
    late = NOON + timedelta(hours=1)
    leased(row, now=late).settle(failed(), now=late)
    retrying.retry_failed(job)
    leased(row, now=late)
    assert AUGMENTATIONS.take_back_lost(now=late + timedelta(minutes=1)) == [row.pk]


def test_the_database_refuses_a_running_row_without_a_claim() -> None:
    row = only_row(launch())
    with pytest.raises(IntegrityError), transaction.atomic():
        Augmentation.objects.filter(pk=row.pk).update(state=State.RUNNING)


def test_the_database_refuses_a_claim_on_a_row_that_does_not_run() -> None:
    row = only_row(launch())
    held = leased(row)
    with pytest.raises(IntegrityError), transaction.atomic():
        Augmentation.objects.filter(claim=held.token).update(state=State.FAILED)


def test_the_database_refuses_a_done_row_without_a_picture() -> None:
    row = only_row(launch())
    with pytest.raises(IntegrityError), transaction.atomic():
        Augmentation.objects.filter(pk=row.pk).update(state=State.DONE, modification={})


def test_the_database_refuses_two_attempts_of_one_number() -> None:
    row = only_row(launch())
    leased(row)
    with pytest.raises(IntegrityError), transaction.atomic():
        Attempt.objects.create(augmentation=row, number=1, started_at=NOON)


def test_the_database_refuses_a_second_row_for_one_cell() -> None:
    row = only_row(launch())
    with pytest.raises(IntegrityError), transaction.atomic():
        Augmentation.objects.create(
            job_id=row.job_id, scenario_id=row.scenario_id, contestant_id=row.contestant_id
        )
