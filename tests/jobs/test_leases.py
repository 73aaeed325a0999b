from __future__ import annotations

from datetime import timedelta

import pytest
from django.db import IntegrityError, transaction

from augment.models import Attempt, Augmentation, GenerationJob
from augment.services.running import jobs, leases
from tests.jobs.rows import NOON, STALE, done, failed, launch, leased, only_row

pytestmark = pytest.mark.django_db
State = Augmentation.State
LATER = NOON + timedelta(seconds=30)


def test_a_waiting_row_can_be_claimed_once() -> None:
    row = only_row(launch())
    first = leases.take_lease(augmentation_pk=row.pk, now=NOON, worker="w1")
    second = leases.take_lease(augmentation_pk=row.pk, now=NOON, worker="w2")
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
    assert leases.take_lease(augmentation_pk=row.pk, now=NOON) is None
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
    held = leases.take_lease(augmentation_pk=row.pk, now=NOON)
    assert (held is not None) == is_started
    row.refresh_from_db()
    assert row.state == (State.RUNNING if is_started else State.QUEUED)


def test_an_outcome_is_written_with_its_attempt() -> None:
    row = only_row(launch())
    held = leased(row)
    assert leases.settle(held=held, settlement=done(), now=LATER)
    row.refresh_from_db()
    assert (row.state, row.image, row.finished_at) == (State.DONE, "bev/x.png", LATER)
    assert (row.claim, row.heartbeat_at) == (None, None)
    attempt = row.attempts.get()
    assert (attempt.outcome, attempt.finished_at) == ("done", LATER)


def test_an_outcome_is_written_once() -> None:
    row = only_row(launch())
    held = leased(row)
    assert leases.settle(held=held, settlement=done(), now=NOON)
    assert not leases.settle(held=held, settlement=failed(), now=LATER)
    row.refresh_from_db()
    assert row.state == State.DONE


def test_a_heartbeat_keeps_the_claim() -> None:
    row = only_row(launch())
    held = leased(row)
    assert leases.renew(held=held, now=NOON + timedelta(seconds=15))
    assert leases.take_back_stale(now=LATER, older_than=STALE) == []
    row.refresh_from_db()
    assert row.state == State.RUNNING


def test_a_claim_without_heartbeat_is_taken_back_and_its_attempt_is_lost() -> None:
    row = only_row(launch())
    leases.mark_sent(ids=[row.pk], now=NOON)
    leased(row)
    assert leases.take_back_stale(now=LATER, older_than=STALE) == [row.pk]
    row.refresh_from_db()
    assert (row.state, row.claim, row.sent_at) == (State.QUEUED, None, None)
    attempt = row.attempts.get()
    assert (attempt.outcome, attempt.finished_at) == ("lost", None)


def test_a_row_that_was_taken_back_gets_a_second_attempt() -> None:
    row = only_row(launch())
    leased(row)
    leases.take_back_stale(now=LATER, older_than=STALE)
    again = leased(row, now=LATER)
    assert again.attempt_number == 2
    leases.settle(held=again, settlement=done(), now=LATER)
    assert list(row.attempts.values_list("number", "outcome")) == [(1, "lost"), (2, "done")]


def test_a_worker_that_lost_its_claim_writes_nothing(caplog: pytest.LogCaptureFixture) -> None:
    row = only_row(launch())
    slow = leased(row)
    leases.take_back_stale(now=LATER, older_than=STALE)
    current = leased(row, now=LATER)
    assert not leases.renew(held=slow, now=LATER)
    assert not leases.is_held(held=slow)
    assert not leases.keep_modification(held=slow, modification={}, notes="")
    assert not leases.settle(held=slow, settlement=failed(), now=LATER)
    assert not leases.release(held=slow, now=LATER)
    assert "Dropped the result of attempt 1" in caplog.text
    row.refresh_from_db()
    assert (row.state, row.claim, row.modification) == (State.RUNNING, current.token, None)
    assert leases.settle(held=current, settlement=done(), now=LATER)


def test_a_stale_row_of_a_cancelled_job_is_cancelled() -> None:
    job = launch()
    leased(only_row(job))
    jobs.cancel(job)
    assert leases.take_back_stale(now=LATER, older_than=STALE) == []
    assert only_row(job).state == State.CANCELLED


def test_a_row_that_is_given_back_to_a_cancelled_job_is_cancelled() -> None:
    job = launch()
    row = only_row(job)
    held = leased(row)
    jobs.cancel(job)
    leases.release(held=held, now=LATER)
    assert leases.take_lease(augmentation_pk=row.pk, now=LATER) is None
    assert leases.take_back_stale(now=LATER, older_than=STALE) == []
    assert only_row(job).state == State.CANCELLED


def test_texts_that_a_database_can_not_take_are_kept_all_the_same() -> None:
    row = only_row(launch())
    held = leased(row)
    leases.keep_modification(held=held, modification={"id": "a\0"}, notes="b\ud800")
    leases.settle(held=held, settlement=failed("c\0"), now=LATER)
    row.refresh_from_db()
    assert (row.notes, row.reason) == ("b\\ud800", "c\u2400")
    assert row.modification == {"id": "a\u2400"}


def test_a_row_that_kills_its_workers_fails_in_the_end() -> None:
    row = only_row(launch())
    for number in range(1, leases.LOST_LIMIT + 1):
        now = NOON + number * timedelta(minutes=1)
        assert leased(row, now=now).attempt_number == number
        leases.take_back_stale(now=now + timedelta(seconds=30), older_than=STALE)
    row.refresh_from_db()
    assert row.state == State.FAILED
    assert "Lost 5 workers" in row.reason


def test_workers_lost_before_an_outcome_are_forgiven() -> None:
    job = launch()
    row = only_row(job)
    for number in range(leases.LOST_LIMIT - 1):
        now = NOON + number * timedelta(minutes=1)
        leased(row, now=now)
        leases.take_back_stale(now=now + timedelta(seconds=30), older_than=STALE)
    late = NOON + timedelta(hours=1)
    leases.settle(held=leased(row, now=late), settlement=failed(), now=late)
    jobs.retry_failed(job)
    leased(row, now=late)
    assert leases.take_back_stale(now=late + timedelta(minutes=1), older_than=STALE) == [row.pk]


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
