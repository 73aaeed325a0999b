from datetime import timedelta

import pytest
from django.contrib.auth.models import User

from augment.errors import Conflict
from augment.models import Augmentation, Contestant, Event, GenerationJob
from augment.services.running import jobs
from augment.services.running.jobs import JobRequest
from augment.services.running.progress import count_rows, generalise_reason
from augment.services.running.runner import AUGMENTATIONS
from tests.jobs.rows import NOON, add_kind, add_scenario, done, failed, launch, leased

pytestmark = pytest.mark.django_db
State = Augmentation.State
Job = GenerationJob.State


def test_a_launch_makes_a_waiting_row_for_each_cell_and_is_logged() -> None:
    for slug in ("reference", "rule"):
        add_kind(slug, Contestant.Kind.RULE)
    scenarios = [add_scenario(f"street-{number}").slug for number in range(3)]
    admin, contestants = User.objects.create_user("admin"), ["reference", "rule"]
    asked = JobRequest(name="R", contestants=contestants, scenarios=scenarios)
    job = jobs.launch(asked, actor=admin)
    assert (job.state, job.launched_by) == (GenerationJob.State.RUNNING, admin)
    assert count_rows(job).by_state == dict.fromkeys(State, 0) | {State.QUEUED: 6}
    assert set(job.augmentations.values_list("sent_at", flat=True)) == {None}
    event = Event.objects.get()
    assert (event.actor, event.verb, event.object_code) == (admin, "launch", str(job.code))
    assert (event.after["name"], event.after["contestants"]) == ("R", contestants)


def test_the_reference_can_not_run_where_there_is_none() -> None:
    add_kind("reference")
    add_kind("rule-placer", Contestant.Kind.RULE)
    add_scenario("bare", reference=None)
    add_scenario("full")
    with pytest.raises(Conflict, match="without a reference modification: bare"):
        jobs.launch(JobRequest(name="R", contestants=["reference"], scenarios=["full", "bare"]))
    jobs.launch(JobRequest(name="R", contestants=["rule-placer"], scenarios=["bare"]))


def test_a_job_is_finished_when_nothing_is_under_way() -> None:
    job = launch(scenarios=2)
    first, second = job.augmentations.order_by("pk")
    leased(first).settle(done(), now=NOON)
    assert jobs.finish_if_over(job_pk=job.pk, now=NOON) == 0
    held = leased(second)
    assert jobs.finish_if_over(job_pk=job.pk, now=NOON) == 0
    held.settle(failed(), now=NOON)
    assert not count_rows(job).is_over, "pages look on"
    assert jobs.finish_if_over(job_pk=job.pk, now=NOON) == 1
    assert jobs.finish_if_over(job_pk=job.pk, now=NOON) == 0
    job.refresh_from_db()
    assert count_rows(job).is_over
    assert (job.state, job.finished_at) == (GenerationJob.State.FINISHED, NOON)


def test_cancel_stops_what_waits_and_keeps_what_is_done_or_runs() -> None:
    job = launch(scenarios=3)
    first, second, third = job.augmentations.order_by("pk")
    leased(first).settle(done(), now=NOON)
    held = leased(second)
    jobs.cancel(job)
    assert job.state == GenerationJob.State.CANCELLED
    third.refresh_from_db()
    assert third.state == State.CANCELLED
    assert AUGMENTATIONS.take(third.pk, now=NOON) is None
    assert held.settle(done(), now=NOON)
    assert jobs.finish_if_over(job_pk=job.pk, now=NOON) == 0
    counts = count_rows(job)
    assert [counts.by_state[state] for state in (State.DONE, State.CANCELLED)] == [2, 1]
    event = Event.objects.filter(verb="cancel").get()
    assert event.after == {"state": "cancelled", "cancelled": 1}


def test_retry_queues_failed_rows_alone_and_opens_the_job_again() -> None:
    job = launch(scenarios=2)
    first, second = job.augmentations.order_by("pk")
    leased(first).settle(failed(), now=NOON)
    leased(second).settle(done(), now=NOON)
    jobs.finish_if_over(now=NOON)
    jobs.retry_failed(job)
    assert (job.state, job.finished_at) == (GenerationJob.State.RUNNING, None)
    first.refresh_from_db()
    second.refresh_from_db()
    assert (first.state, first.reason, first.sent_at) == (State.QUEUED, "", None)
    assert second.state == State.DONE
    leased(first)
    assert first.attempts.count() == 2


def test_a_paused_job_starts_nothing_and_what_is_in_flight_keeps_its_result() -> None:
    job = launch(scenarios=3)
    first, second, third = job.augmentations.order_by("pk")
    held = leased(first)
    job = jobs.pause(job)
    assert job.state == Job.PAUSED
    assert Event.objects.get(verb="pause").after == {
        "state": "paused",
        "waiting": 2,
        "in_flight": 1,
    }
    assert AUGMENTATIONS.take(second.pk) is None
    assert AUGMENTATIONS.find_unsent(older_than=timedelta(0)) == []
    assert count_rows(job).is_moving, "one is in flight"
    assert held.settle(done())
    assert not count_rows(job).is_moving
    jobs.finish_if_over()
    job = jobs.resume(job)
    assert job.state == Job.RUNNING
    assert Event.objects.get(verb="resume").before == {"state": "paused", "cap": "nothing"}
    assert AUGMENTATIONS.find_unsent(older_than=timedelta(0)) == [second.pk, third.pk]
    first.refresh_from_db()
    assert first.state == State.DONE


def test_reasons_have_one_cause_where_only_numbers_and_ids_differ() -> None:
    for reason, other, are_alike in (
        ("HTTP 429: slow down, try in 3 s", "HTTP 429: slow down, try in 17.5 s", True),
        ("HTTP 429: slow down", "HTTP 503: slow down", False),
        ("request req_9f31ab20c4de77aa broke", "request req_0011ab20c4de77ff broke", True),
        (
            "no 3f2504e0-4f89-11d3-9a0c-0305e82c3301",
            "no 3f2504e0-4f89-11d3-9a0c-0305e82c3302",
            True,
        ),
        ("line 3 column 7: no block", "line 12 column 1: no block", True),
        ("Lane3 is unknown", "Lane4 is unknown", False),
        ("the wire broke", "the  wire\nbroke", True),
        ("gpt-4 answered nothing", "gpt-5 answered nothing", False),
    ):
        assert (generalise_reason(reason) == generalise_reason(other)) is are_alike
