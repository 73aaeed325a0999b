from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from uuid import uuid4

import pytest
from django.db import IntegrityError, connection, transaction
from django.test.utils import CaptureQueriesContext
from django.utils import timezone

from augment import tasks
from augment.errors import Conflict
from augment.models import Attempt, Augmentation, CallLease, GenerationJob
from augment.services.clock import DATABASE_TIME, database_now
from augment.services.endpoints import client
from augment.services.running import jobs, runner
from augment.services.running.budget import Caps
from augment.services.running.progress import count_rows
from augment.services.running.runner import AUGMENTATIONS, Held
from augment.services.work import Settlement, change_all
from tests.brokers import MEMORY, broker_at
from tests.jobs.models import Model, add_llama, llama_job
from tests.jobs.rows import NOON, done, failed, launch, leased, only_row
from tests.processes import wait_until

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


@pytest.mark.parametrize("is_given_back", [True, False])
def test_a_row_under_way_of_a_cancelled_job_is_cancelled_once_back(is_given_back: bool) -> None:
    job = launch()
    row = only_row(job)
    held = leased(row)
    jobs.cancel(job)
    if is_given_back:
        held.release(now=LATER)
        assert AUGMENTATIONS.take(row.pk, now=LATER) is None
        AUGMENTATIONS.cleanup(LATER)
    else:
        assert AUGMENTATIONS.take_back_lost(now=LATER) == []
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


def test_the_database_refuses_a_row_that_can_not_be() -> None:
    row = only_row(launch())
    for columns in REFUSED.values():
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
    endpoint.max_concurrency = 1
    endpoint.save()
    clock = client.Queue(longest_s=0.0).clock
    skew(seconds)
    assert not isinstance(client.admit(endpoint_pk=endpoint.pk, clock=clock), float)
    skew(-seconds)
    assert client.admit(endpoint_pk=endpoint.pk, clock=clock) == 0.0
    assert CallLease.objects.get().started_at <= database_now()


def test_an_outcome_is_kept_where_the_clock_was_set_back_meanwhile() -> None:
    row, held = taken()
    row.attempts.update(started_at=DATABASE_TIME + timedelta(hours=2))
    assert held.settle(Settlement(state=State.FAILED, reason="It broke."))
    attempt = row.attempts.get()
    assert attempt.finished_at == attempt.started_at


ROWS, JOB = "augment_augmentation", "augment_generationjob"


def held(act: Callable[[], object]) -> list[str]:
    """Of which of the two tables rows are changed first, and of which then."""
    with CaptureQueriesContext(connection) as captured:
        act()
    changes = [query["sql"].split('"')[1] for query in captured if query["sql"][:6] == "UPDATE"]
    return [table for table in dict.fromkeys(changes) if table in (ROWS, JOB)]


def test_a_worker_holds_its_row_before_the_job() -> None:
    job = llama_job()
    pk = job.augmentations.get().pk
    assert held(lambda: runner.Augmentations(Model()).perform(pk)) == [ROWS, JOB]


def test_who_raises_a_cap_and_resumes_holds_what_waits_before_the_job() -> None:
    job = llama_job(caps=Caps(cap_tokens=5))
    runner.Augmentations(Model()).perform(job.augmentations.get().pk)
    assert held(lambda: jobs.resume(job, higher=Caps(cap_tokens=50_000))) == [ROWS, JOB]
    job.refresh_from_db()
    assert (job.state, job.cap_tokens) == ("running", 50_000)


def all_failed() -> GenerationJob:
    job = launch(scenarios=2)
    job.augmentations.update(state="failed", reason="the wire broke")
    return job


def test_who_retries_holds_the_rows_before_the_job() -> None:
    job = all_failed()
    assert held(lambda: jobs.retry_failed(job)) == [ROWS, JOB]


@pytest.mark.django_db(transaction=True)
def test_two_who_retry_at_once_wait_for_each_other_and_never_in_a_circle() -> None:
    """On PostgreSQL the one who comes second waits for the rows, holding nothing of the job."""
    job = all_failed()

    def retry() -> str:
        try:
            jobs.retry_failed(job)
        except Conflict as refused:
            return str(refused)
        finally:
            connection.close()
        return ""

    with ThreadPoolExecutor(1) as pool:
        with transaction.atomic():
            change_all(job.augmentations.all(), state="queued", reason="")
            second = pool.submit(retry)
            if connection.vendor == "postgresql":
                wait_until(somebody_waits, what="the second one waits")
            jobs.open_again(job)
        assert "Nothing in job" in second.result(timeout=30)
    assert count_rows(job).queued == 2


def somebody_waits() -> bool:
    with connection.cursor() as cursor:
        cursor.execute("SELECT pg_stat_clear_snapshot()")  # else one transaction sees one moment
        cursor.execute(
            "SELECT count(*) FROM pg_stat_activity"
            " WHERE datname = current_database() AND wait_event_type = 'Lock'"
        )
        return bool(cursor.fetchone()[0])


def test_of_many_rows_the_first_is_held_first() -> None:
    job = launch(scenarios=3)
    pks = list(job.augmentations.values_list("pk", flat=True))
    with CaptureQueriesContext(connection) as captured:
        AUGMENTATIONS.mark_sent(pks, now=timezone.now())
    looked, changed = (query["sql"] for query in captured if ROWS in query["sql"])
    assert " ORDER BY 1 ASC" in looked
    assert ("FOR NO KEY UPDATE" in looked) is (connection.vendor == "postgresql")
    assert changed.startswith(f'UPDATE "{ROWS}"')


def test_who_ends_a_row_of_many_locks_nobody_else_out() -> None:
    """The job's row is what all its workers share: it is held only to finish the job."""
    job = launch(scenarios=2)
    first, last = job.augmentations.order_by("pk")
    for row, statements in ((first, 1), (last, 6)):
        leased(row, timezone.now()).settle(failed())
        with CaptureQueriesContext(connection) as captured:
            finished = jobs.finish_if_over(job_pk=job.pk)
        assert len(captured) == statements, [query["sql"] for query in captured]
        assert finished == (row == last)


def test_a_call_is_settled_before_the_job_is_held() -> None:
    job = llama_job()
    with CaptureQueriesContext(connection) as captured:
        runner.Augmentations(Model()).perform(job.augmentations.get().pk)
    changes = [query["sql"].split('"')[1] for query in captured if query["sql"][:6] == "UPDATE"]
    reserved, settled, *_ = (place for place, table in enumerate(changes) if table == JOB)
    assert changes[reserved + 1 : settled].count("augment_modelcall") == 2, "sent, then answered"
