from collections.abc import Callable, Iterator
from datetime import timedelta
from uuid import uuid4

import pytest
from django.db import IntegrityError, transaction
from django.utils import timezone

from augment import tasks
from augment.models import Attempt, Augmentation, CallLease, GenerationJob
from augment.services.clock import DATABASE_TIME, database_now
from augment.services.endpoints import client
from augment.services.running import jobs
from augment.services.running.runner import AUGMENTATIONS, Held
from tests.brokers import MEMORY, broker_at
from tests.jobs.models import add_llama
from tests.jobs.rows import NOON, done, failed, launch, leased, only_row

pytestmark = pytest.mark.django_db
State = Augmentation.State
Skew = Callable[[float], None]
LATER = NOON + timedelta(seconds=30)


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
    AUGMENTATIONS.cleanup(LATER)
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
    jobs.retry_failed(job)
    leased(row, now=late)
    assert AUGMENTATIONS.take_back_lost(now=late + timedelta(minutes=1)) == [row.pk]


REFUSED: dict[str, dict[str, object]] = {
    "running without a claim": {"state": State.RUNNING},
    "done without a picture": {"state": State.DONE, "modification": {}},
    "a claim on what waits": {"claim": uuid4(), "heartbeat_at": NOON},
}


@pytest.mark.parametrize("columns", REFUSED.values(), ids=REFUSED)
def test_the_database_refuses_a_row_that_can_not_be(columns: dict[str, object]) -> None:
    row = only_row(launch())
    with pytest.raises(IntegrityError), transaction.atomic():
        Augmentation.objects.filter(pk=row.pk).update(**columns)


def test_the_database_refuses_a_second_attempt_of_one_number_and_a_second_row_of_a_cell() -> None:
    row = only_row(launch())
    leased(row)
    with pytest.raises(IntegrityError), transaction.atomic():
        Attempt.objects.create(augmentation=row, number=1, started_at=NOON)
    with pytest.raises(IntegrityError), transaction.atomic():
        Augmentation.objects.create(
            job_id=row.job_id, scenario_id=row.scenario_id, contestant_id=row.contestant_id
        )


@pytest.fixture
def skew(monkeypatch: pytest.MonkeyPatch) -> Skew:
    """Sets the clock of this worker wrong by so many seconds."""
    right = timezone.now

    def put(seconds: float) -> None:
        monkeypatch.setattr(timezone, "now", lambda: right() + timedelta(seconds=seconds))

    return put


@pytest.fixture(autouse=True)
def _broker() -> Iterator[None]:
    with broker_at(MEMORY):
        yield


def taken() -> tuple[Augmentation, Held]:
    row = only_row(launch())
    held = AUGMENTATIONS.take(row.pk, worker="here")
    assert held is not None
    return row, held


def silent_for(row: Augmentation, seconds: float) -> None:
    """As if the holder had last been heard so long ago, on the database's clock."""
    Augmentation.objects.filter(pk=row.pk).update(
        heartbeat_at=DATABASE_TIME - timedelta(seconds=seconds)
    )


@pytest.mark.parametrize("seconds", [-40.0, 40.0])
@pytest.mark.parametrize("worker", ["holder", "other"])
def test_40_s_of_skew_take_no_living_claim_back(skew: Skew, seconds: float, worker: str) -> None:
    if worker == "holder":
        skew(seconds)
    row, held = taken()
    assert held.renew()
    skew(seconds if worker == "other" else 0.0)
    tasks.recover()
    assert held.is_held()
    row.refresh_from_db()
    assert row.state == State.RUNNING


@pytest.mark.parametrize("seconds", [-40.0, 0.0, 40.0])
@pytest.mark.parametrize(("silent_s", "state"), [(10.0, State.RUNNING), (25.0, State.QUEUED)])
def test_a_dead_claim_is_taken_back_whatever_the_clock_of_who_looks(
    skew: Skew, seconds: float, silent_s: float, state: State
) -> None:
    row, _ = taken()
    silent_for(row, silent_s)
    skew(seconds)
    AUGMENTATIONS.take_back_lost()
    row.refresh_from_db()
    assert row.state == state


@pytest.mark.parametrize("seconds", [-70.0, 70.0])
def test_a_wrong_clock_takes_no_place_that_is_taken(skew: Skew, seconds: float) -> None:
    endpoint = add_llama().endpoint
    assert endpoint is not None
    endpoint.max_concurrency = 1
    endpoint.save()
    clock = client.Queue(longest_s=0.0).clock
    skew(seconds)
    assert not isinstance(client.admit(endpoint_pk=endpoint.pk, clock=clock), float)
    skew(-seconds)
    assert client.admit(endpoint_pk=endpoint.pk, clock=clock) == 0.0
    assert CallLease.objects.get().started_at <= database_now()
