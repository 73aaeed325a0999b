"""Launching, watching, retrying and cancelling a job by its pages."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta

import pytest
from django.test import Client
from django.urls import reverse

from arena.templatetags.marks import job_mark
from augment.models import Augmentation, GenerationJob, Worker
from augment.services.clock import database_now
from augment.services.running import jobs, leases
from augment.services.running.causes import failure_groups
from augment.services.running.pace import pace_of
from augment.services.running.summary import count_rows
from augment.services.running.workers import Presence
from tests.jobs import rows
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db

State = Augmentation.State
OnCommit = Callable[..., object]


def test_a_launched_job_has_a_row_per_contestant_and_scenario(
    django_capture_on_commit_callbacks: OnCommit,
) -> None:
    rows.add_kind("reference")
    for slug in ("one", "two"):
        rows.add_scenario(slug)
    admin = signed_in(people()["admin"])
    sent = {"name": "Night run", "contestants": ["reference"], "scenarios": ["one", "two"]}
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        answer = admin.post(reverse("job-new"), sent)
    job = GenerationJob.objects.get()
    assert answer.headers["Location"] == reverse("job", args=[job.code])
    assert job.augmentations.filter(state="queued").count() == 2
    assert len(waiting) == 1, "the rows are put on the queue once they are stored"


def test_a_whole_type_stands_for_its_scenarios_without_a_script() -> None:
    rows.add_kind("reference")
    for slug in ("one", "two"):
        rows.add_scenario(slug)
    sent = {
        "name": "Whole type",
        "contestants": ["reference"],
        "types": ["approaching_construction_zone"],
    }
    signed_in(people()["admin"]).post(reverse("job-new"), sent)
    assert GenerationJob.objects.get().augmentations.count() == 2


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        ("contestants", "Choose at least one contestant."),
        ("scenarios", "Choose at least one scenario."),
        ("name", "This field is required."),
    ],
)
def test_a_job_that_misses_something_is_not_launched(missing: str, sentence: str) -> None:
    rows.add_kind("reference")
    rows.add_scenario("one")
    sent = {"name": "Night run", "contestants": ["reference"], "scenarios": ["one"]}
    del sent[missing]
    answer = signed_in(people()["admin"]).post(reverse("job-new"), sent)
    assert answer.status_code == 422
    assert sentence in answer.content.decode()
    assert not GenerationJob.objects.exists()


def test_a_job_that_could_not_end_is_refused_in_words() -> None:
    rows.add_kind("reference")
    rows.add_scenario("bare", reference=None)
    sent = {"name": "Night run", "contestants": ["reference"], "scenarios": ["bare"]}
    answer = signed_in(people()["admin"]).post(reverse("job-new"), sent)
    assert answer.status_code == 422
    assert "without a reference" in answer.content.decode()


def test_the_page_groups_failures_by_their_reason_and_retries_them() -> None:
    job = rows.launch(scenarios=3)
    for row in job.augmentations.all():
        leases.settle(held=rows.leased(row), settlement=rows.failed(), now=rows.NOON)
    admin, url = signed_in(people()["admin"]), reverse("job", args=[job.code])
    shown = admin.get(url).content.decode()
    assert shown.count("The wire broke") == 1
    assert "Retry 3 failed" in shown
    admin.post(reverse("job-retry", args=[job.code]))
    assert job.augmentations.filter(state=Augmentation.State.QUEUED).count() == 3


def test_one_cause_is_retried_and_the_others_are_not() -> None:
    job = rows.launch(scenarios=3)
    reasons = ["HTTP 429: in 3 s", "HTTP 429: in 9 s", "the wire broke"]
    for row, reason in zip(job.augmentations.all(), reasons, strict=True):
        leases.settle(held=rows.leased(row), settlement=rows.failed(reason), now=rows.NOON)
    admin, url = signed_in(people()["admin"]), reverse("job", args=[job.code])
    shown = admin.get(url).content.decode()
    assert "2 reasons that differ in numbers and ids alone" in shown
    assert "Retry these 2" in shown
    key = failure_groups(job)[0].key
    admin.post(reverse("job-retry-cause", args=[job.code, key]))
    assert job.augmentations.filter(state=State.QUEUED).count() == 2
    assert "the wire broke" in admin.get(url).content.decode().lower()
    gone = admin.post(reverse("job-retry-cause", args=[job.code, key]), follow=True)
    assert "cause in this job" in gone.content.decode()


def test_an_unreadable_answer_gets_its_second_chance_after_a_question_alone() -> None:
    job = rows.launch(scenarios=2)
    job.augmentations.update(state=State.UNREADABLE, reason="no block", image="bev/x.png")
    admin = signed_in(people()["admin"])
    url = reverse("job-retry-cause", args=[job.code, failure_groups(job)[0].key])
    asked = admin.post(url).content.decode()
    assert "Ask again for 2 unreadable answers?" in asked
    assert "a second chance that the others did not have" in asked
    assert job.augmentations.filter(state=State.UNREADABLE).count() == 2
    admin.post(url, {"sure": "1"})
    assert job.augmentations.filter(state=State.QUEUED, asked_anew_at__isnull=False).count() == 2


def test_what_a_study_shows_is_not_asked_again() -> None:
    here = world()
    shown = here.study.matchups.order_by("pk")[0].left
    job = shown.job
    job.augmentations.filter(pk=shown.pk).update(state=State.UNREADABLE, reason="no block")
    key = failure_groups(job)[0].key
    answer = signed_in(people()["admin"]).post(
        reverse("job-retry-cause", args=[job.code, key]), {"sure": "1"}, follow=True
    )
    assert "Experts are shown 1 of these 1" in answer.content.decode()
    shown.refresh_from_db()
    assert shown.state == State.UNREADABLE


def test_a_job_is_paused_says_what_still_runs_and_is_resumed() -> None:
    job = rows.launch(scenarios=3)
    held = rows.leased(job.augmentations.all()[0])
    admin, url = signed_in(people()["admin"]), reverse("job", args=[job.code])
    answer = admin.post(reverse("job-pause", args=[job.code]), follow=True).content.decode()
    assert "Pausing, 1 still runs" in answer
    assert 'id="pause"' not in answer
    leases.settle(held=held, settlement=rows.done(), now=rows.NOON)
    shown = admin.get(url).content.decode()
    assert "Paused" in shown
    assert "js/job.js" not in shown, "nothing moves"
    admin.post(reverse("job-resume", args=[job.code]))
    job.refresh_from_db()
    assert job.state == GenerationJob.State.RUNNING
    assert (
        "is paused or stopped"
        in admin.post(reverse("job-resume", args=[job.code]), follow=True).content.decode()
    )


def test_a_moving_job_says_how_fast_it_goes_and_when_it_is_through() -> None:
    job = rows.launch(scenarios=4)
    admin, url = signed_in(people()["admin"]), reverse("job", args=[job.code])
    assert "Nothing has ended in the last five minutes." in admin.get(url).content.decode()
    now = database_now()
    for row in job.augmentations.all()[:2]:
        held = rows.leased(row, now - timedelta(minutes=2))
        leases.settle(held=held, settlement=rows.done(), now=now - timedelta(minutes=1))
    pace = pace_of(count_rows(job), now=now)
    assert (pace.rows_per_minute, pace.calls_per_minute) == (1.0, 0.0)
    assert pace.left_s == 120.0
    assert "about 2 min left" in admin.get(url).content.decode()


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (State.FAILED, "Failed"),
        (State.UNREADABLE, "Finished without a modification"),
        (State.REFUSED, "Finished without a modification"),
    ],
)
def test_a_job_without_a_single_result_is_not_green(state: str, words: str) -> None:
    job = rows.launch(scenarios=2)
    job.augmentations.update(state=state)
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    mark = job_mark(count_rows(GenerationJob.objects.get()))
    assert (mark.label, mark.tone == "good") == (words, False)


def test_cancelling_keeps_what_is_done_and_says_so_twice() -> None:
    job = rows.launch(scenarios=2)
    first = job.augmentations.all()[0]
    leases.settle(held=rows.leased(first), settlement=rows.done(), now=rows.NOON)
    admin, url = signed_in(people()["admin"]), reverse("job-cancel", args=[job.code])
    admin.post(url, {"sure": "1"})
    states = sorted(job.augmentations.values_list("state", flat=True))
    assert states == ["cancelled", "done"]
    assert "already" in admin.post(url, {"sure": "1"}, follow=True).content.decode()


def test_progress_is_counted_and_not_sent_again_while_nothing_changes() -> None:
    job = rows.launch(scenarios=2)
    admin, url = signed_in(people()["admin"]), reverse("job-progress", args=[job.code])
    first = admin.get(url)
    body = first.json()
    assert (body["total"], body["settled"], body["is_over"]) == (2, 0, False)
    assert body["by_state"]["queued"] == 2
    same = admin.get(url, headers={"If-None-Match": first.headers["ETag"]})
    assert (same.status_code, same.content) == (304, b"")
    row = job.augmentations.all()[0]
    leases.settle(held=rows.leased(row), settlement=rows.done(), now=rows.NOON)
    changed = admin.get(url, headers={"If-None-Match": first.headers["ETag"]})
    assert changed.json()["settled"] == 1


def test_an_augmentations_page_shows_its_numbers_and_escapes_what_came_from_outside() -> None:
    job = rows.launch()
    row = rows.only_row(job)
    leases.settle(held=rows.leased(row), settlement=rows.done(), now=rows.NOON)
    Augmentation.objects.filter(pk=row.pk).update(notes="<script>alert(1)</script>")
    shown = signed_in(people()["analyst"]).get(reverse("augmentation", args=[row.code]))
    page = shown.content.decode()
    assert "20.00" in page
    assert "traffic cone" in page
    assert "<script>alert(1)" not in page


def test_the_job_page_asks_the_database_a_fixed_number_of_questions(
    django_assert_max_num_queries: Callable[..., object],
) -> None:
    job = rows.launch(scenarios=8, contestants=("reference",))
    admin = signed_in(people()["admin"])
    with django_assert_max_num_queries(16):  # type: ignore[attr-defined]
        admin.get(reverse("job", args=[job.code]))


# --- Whether anybody works -----------------------------------------------------------------------


@pytest.fixture
def staff() -> dict[str, Client]:
    made = people()
    return {name: signed_in(made[name]) for name in ("admin", "analyst")}


def page(staff: dict[str, Client], name: str, job: GenerationJob) -> str:
    address = reverse(name, args=[job.code] if name == "job" else [])
    return staff["analyst"].get(address).content.decode()


def is_worked_on(staff: dict[str, Client], job: GenerationJob) -> bool:
    found = staff["admin"].get(reverse("job-progress", args=[job.code]))
    return bool(found.json()["is_worked_on"])


@pytest.mark.parametrize("name", ["job", "jobs"])
def test_a_page_with_waiting_work_says_since_when_no_worker_runs(
    staff: dict[str, Client], name: str
) -> None:
    job = rows.launch()
    assert "No worker has been running yet." in page(staff, name, job)
    Presence("here 1").beat()
    Worker.objects.update(seen_at=rows.NOON)
    found = page(staff, name, job)
    assert "No worker has been running since 20 November 2026, 12:00." in found
    assert "goes on as soon as one starts" in found
    assert not is_worked_on(staff, job)


@pytest.mark.parametrize("name", ["job", "jobs"])
def test_a_page_says_since_when_and_why_lost_work_is_not_brought_back(
    staff: dict[str, Client], name: str
) -> None:
    job = rows.launch()
    presence = Presence("here 1")
    presence.recovered()
    assert 'id="workforce"' not in page(staff, name, job)
    assert is_worked_on(staff, job)
    Worker.objects.update(recovered_at=rows.NOON)
    presence.failed("Redis takes no messages: OOM <b>")
    found = page(staff, name, job)
    assert "not been brought back since 20 November 2026, 12:00." in found
    assert "The reason: Redis takes no messages: OOM &lt;b&gt;" in found
    assert not is_worked_on(staff, job)


def test_where_nothing_waits_nobody_is_missed(staff: dict[str, Client]) -> None:
    job = rows.launch()
    leases.settle(held=rows.leased(rows.only_row(job)), settlement=rows.done(), now=rows.NOON)
    jobs.finish_if_over()
    assert all('id="workforce"' not in page(staff, name, job) for name in ("job", "jobs"))
