"""Who changes rows and their job takes the rows first, so that nobody waits in a circle."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from django.db import connection, transaction
from django.test.utils import CaptureQueriesContext
from django.utils import timezone

from augment.errors import Conflict
from augment.models import GenerationJob
from augment.services.running import jobs, runner
from augment.services.running.budget import Caps
from augment.services.running.progress import count_rows
from augment.services.running.runner import AUGMENTATIONS
from augment.services.work import change_all
from tests.jobs.models import Model, llama_job
from tests.jobs.rows import failed, launch, leased
from tests.processes import wait_until

pytestmark = pytest.mark.django_db

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
