"""Launching, watching, retrying and cancelling a job by its pages."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from django.test import Client
from django.urls import reverse

from augment.models import Augmentation, GenerationJob, Worker
from augment.services.running import jobs, leases
from augment.services.running.workers import Presence
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

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
    rows.add_scenario("one")
    sent = {"name": "Night run", "contestants": ["reference"], "scenarios": ["one"]}
    del sent[missing]
    answer = signed_in(people()["admin"]).post(reverse("job-new"), sent)
    assert answer.status_code == 422
    assert sentence in answer.content.decode()
    assert not GenerationJob.objects.exists()


def test_a_job_that_could_not_end_is_refused_in_words() -> None:
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
    with django_assert_max_num_queries(11):  # type: ignore[attr-defined]
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
