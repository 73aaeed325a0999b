import json
from collections.abc import Callable, Iterator
from datetime import timedelta
from typing import Any

import pytest
from celery.exceptions import Reject
from django.core.files.storage import default_storage
from django.db import connection
from django.test.utils import CaptureQueriesContext
from django.utils import timezone

from augment import tasks
from augment.errors import Conflict, LeaseLost
from augment.llm.messages import Reply
from augment.models import Augmentation, Contestant, GenerationJob, ModelCall
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Modification
from augment.services.running import jobs, runner, workers
from augment.services.running.choosing import resolve_contestants
from augment.services.running.jobs import JobRequest
from augment.services.running.runner import AUGMENTATIONS
from tests.jobs.models import Model, Wire, llama_job, ran, reply
from tests.jobs.rows import INSTRUCTION, TWO_CONES, add_kind, add_scenario, launch, only_row
from tests.variants.playing import GOOD

pytestmark = pytest.mark.django_db
State = Augmentation.State


def test_the_reference_runs_to_its_picture_and_the_job_is_finished() -> None:
    row = ran(only_row(launch()))
    assert row.state == State.DONE
    assert modification_from_document(row.modification) == TWO_CONES
    assert default_storage.exists(row.image)
    row.scenario.refresh_from_db()
    assert default_storage.exists(row.scenario.original_image)
    assert row.image != row.scenario.original_image
    row.job.refresh_from_db()
    assert row.job.state == GenerationJob.State.FINISHED


def test_a_scene_that_can_not_be_read_is_a_failure_with_a_sentence() -> None:
    row = only_row(launch())
    row.scenario.base_scene.document = {"format": "nonsense"}
    row.scenario.base_scene.save()
    row = ran(row)
    assert row.state == State.FAILED
    assert "can't be read" in row.reason


def test_a_model_is_asked_and_every_call_is_kept() -> None:
    reply = Reply(
        text=GOOD,
        model="llama3.1-2407",
        finish_reason="stop",
        prompt_tokens=9000,
        completion_tokens=120,
        latency_s=1.5,
    )
    wire = Wire(reply)
    row = ran(only_row(llama_job()), wire)
    assert (row.state, wire.opened) == (State.DONE, ["local"])
    assert row.notes == "One road, two lanes.\n\nA parked car ahead."
    call = ModelCall.objects.get()
    assert (call.attempt.augmentation, call.number, call.role) == (row, 1, "modifier")
    assert (call.answer, call.fault, call.finish_reason) == (GOOD, "", "stop")
    assert (call.model_returned, call.prompt_tokens) == ("llama3.1-2407", 9000)
    assert (call.completion_tokens, call.latency_s) == (120, 1.5)
    assert call.request["model"] == "llama3.1"
    assert INSTRUCTION in json.dumps(call.request)
    assert call.prompt_version


@pytest.mark.parametrize(("make", "most"), [(launch, 17), (llama_job, 29)])
def test_a_row_asks_the_database_seldom(make: Callable[[], GenerationJob], most: int) -> None:
    row = only_row(make())
    with CaptureQueriesContext(connection) as captured:
        ran(row, Wire(GOOD))
    asked = [query["sql"] for query in captured if "SAVEPOINT" not in query["sql"]]
    assert len(asked) <= most, "\n".join(sql[:100] for sql in asked)


def test_an_answer_that_nobody_can_read_is_an_outcome_with_the_unchanged_picture() -> None:
    row = ran(only_row(llama_job()), Wire("Sorry?", "Pardon?"))
    assert row.state == State.UNREADABLE
    assert row.reason
    assert row.modification is None
    row.scenario.refresh_from_db()
    assert row.image == row.scenario.original_image
    answers = ModelCall.objects.order_by("number").values_list("answer", flat=True)
    assert list(answers) == ["Sorry?", "Pardon?"]


def test_an_attempt_that_was_lost_before_drawing_is_only_drawn_again() -> None:
    row = only_row(llama_job())
    now = timezone.now()
    held = AUGMENTATIONS.take(row.pk, now=now - timedelta(minutes=1))
    document = modification_to_document(TWO_CONES)
    held.note(modification=document, notes="said before")
    AUGMENTATIONS.take_back_lost(now=now)
    wire = Wire()
    row = ran(row, wire)
    assert (row.state, row.notes, row.modification) == (State.DONE, "said before", document)
    assert wire.opened == []


def test_a_worker_whose_claim_was_taken_asks_no_model_and_writes_nothing() -> None:
    row = only_row(llama_job())
    held = AUGMENTATIONS.take(row.pk, now=timezone.now() - timedelta(minutes=1))
    AUGMENTATIONS.take_back_lost(now=timezone.now())
    with pytest.raises(LeaseLost):
        runner.Augmentations(Wire(GOOD)).run(row, held)
    assert not ModelCall.objects.exists()


def one_job(kind: str, **columns: Any) -> Augmentation:
    add_kind("someone", kind)
    add_scenario("street", **columns)
    return only_row(
        jobs.launch(JobRequest(name="R", contestants=["someone"], scenarios=["street"]))
    )


def test_a_reference_that_does_not_fit_is_a_failure_with_a_sentence() -> None:
    gone = modification_to_document(Modification(removed=("Agent9",)))
    row = ran(one_job(Contestant.Kind.REFERENCE, reference=gone))
    assert row.state == State.FAILED
    assert row.reason.startswith("The modification does not fit the scene: Agent9")


def test_a_row_that_waited_for_a_dropped_baseline_fails_with_its_name() -> None:
    add_kind("quantised-5m", Contestant.Kind.BASELINE)
    add_scenario("street")
    request = JobRequest(name="R", contestants=["quantised-5m"], scenarios=["street"])
    row = only_row(jobs.launch(request))
    Contestant.objects.update(slug="quantised-20m")
    row = ran(Augmentation.objects.get(pk=row.pk))
    assert (row.state, row.reason) == (State.FAILED, "A job can't run quantised-20m any more.")


@pytest.mark.parametrize(
    ("slug", "kind", "rates"),
    [("errors", "simulated", {"position": 0.1}), ("quantised-20m", "baseline", None)],
)
def test_contestants_of_an_earlier_version_run_no_more(
    slug: str, kind: str, rates: dict[str, float] | None
) -> None:
    add_kind(slug, Contestant.Kind(kind))
    Contestant.objects.filter(slug=slug).update(error_rates=rates)
    add_scenario("street")
    with pytest.raises(Conflict, match=f"A job can't run {slug}: it was made elsewhere"):
        jobs.launch(JobRequest(name="R", contestants=[slug], scenarios=["street"]))
    assert slug not in resolve_contestants(["all"])


@pytest.fixture(autouse=True)
def _going_on() -> Iterator[None]:
    workers.stopping.clear()
    yield
    workers.stopping.clear()


def only(job: GenerationJob) -> tuple[Augmentation, list[ModelCall]]:
    row = only_row(job)
    calls = ModelCall.objects.filter(attempt__augmentation=row).order_by("pk")
    return row, list(calls)


def test_no_row_is_claimed_any_more_and_its_message_goes_back() -> None:
    row = only_row(launch())
    workers.stopping.set()
    with pytest.raises(Reject) as caught:
        tasks.work.run("augmentation", row.pk)
    assert caught.value.requeue
    row.refresh_from_db()
    assert row.state == State.QUEUED
    assert not row.attempts.exists()


def test_where_nothing_was_sent_the_row_goes_back_unpaid() -> None:
    job = llama_job()
    assert runner.Augmentations(Model(waiting=workers.stopping.set)).perform(only_row(job).pk)
    row, calls = only(job)
    assert (row.state, row.sent_at, row.claim) == (State.QUEUED, None, None)
    assert [(call.sent_at, call.spent_tokens) for call in calls] == [(None, 0)]
    job.refresh_from_db()
    assert (job.spent_calls, job.reserved_calls, job.reserved_tokens) == (0, 0, 0)
    assert row.attempts.get().outcome == "released"


def test_an_answer_before_the_stop_is_not_asked_for_again() -> None:
    """It can't be read, so the model is asked once more: by whoever takes the row next."""
    job = llama_job()
    unreadable = Model(lambda _: reply("no answer at all"), looking_on=workers.stopping.set)
    assert runner.Augmentations(unreadable).perform(only_row(job).pk)
    row, calls = only(job)
    assert row.state == State.QUEUED
    assert len(calls) == 1
    workers.stopping.clear()
    assert runner.Augmentations(Wire(GOOD)).perform(row.pk)
    row, calls = only(job)
    assert row.state == State.DONE
    assert [call.served_from_id is not None for call in calls] == [False, True, False]
    job.refresh_from_db()
    assert job.spent_calls == 2
