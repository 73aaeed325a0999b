"""Launching, watching, retrying and cancelling a job by its pages."""

from collections.abc import Callable

import pytest
from django.test import Client
from django.urls import reverse

from augment.models import Augmentation, GenerationJob, Worker
from augment.services.running.workers import Presence
from tests.jobs import rows
from tests.web.cast import people, signed_in

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


def test_the_page_groups_failures_by_their_reason_and_retries_them() -> None:
    job = rows.launch(scenarios=3)
    for row in job.augmentations.all():
        rows.leased(row).settle(rows.failed(), now=rows.NOON)
    admin, url = signed_in(people()["admin"]), reverse("job-tab", args=[job.code, "failures"])
    shown = admin.get(url).content.decode()
    assert shown.count("The wire broke") == 1
    assert "Retry 3 failed" in shown
    admin.post(reverse("job-retry", args=[job.code]))
    assert job.augmentations.filter(state=Augmentation.State.QUEUED).count() == 3


def test_a_job_is_paused_says_what_still_runs_and_is_resumed() -> None:
    job = rows.launch(scenarios=3)
    held = rows.leased(job.augmentations.all()[0])
    admin, url = signed_in(people()["admin"]), reverse("job", args=[job.code])
    answer = admin.post(reverse("job-pause", args=[job.code]), follow=True).content.decode()
    assert "Pausing, 1 running" in answer
    assert 'id="pause"' not in answer
    held.settle(rows.done(), now=rows.NOON)
    shown = admin.get(url).content.decode()
    assert "Paused" in shown
    assert "js/live.js" not in shown, "nothing moves"
    admin.post(reverse("job-resume", args=[job.code]))
    job.refresh_from_db()
    assert job.state == GenerationJob.State.RUNNING
    assert (
        "be resumed"
        in admin.post(reverse("job-resume", args=[job.code]), follow=True).content.decode()
    )


def test_a_job_that_is_cancelled_before_anything_ran_shows_its_grid() -> None:
    job, admin = rows.launch(), signed_in(people()["admin"])
    admin.post(reverse("job-cancel", args=[job.code]), {"sure": "1"})
    assert 'id="grid"' in admin.get(reverse("job", args=[job.code])).content.decode()


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
    rows.leased(row).settle(rows.done(), now=rows.NOON)
    changed = admin.get(url, headers={"If-None-Match": first.headers["ETag"]})
    assert changed.json()["settled"] == 1


# --- Whether anybody works -----------------------------------------------------------------------


@pytest.fixture
def staff() -> dict[str, Client]:
    made = people()
    return {name: signed_in(made[name]) for name in ("admin", "researcher")}


def page(staff: dict[str, Client], name: str, job: GenerationJob) -> str:
    address = reverse(name, args=[job.code] if name == "job" else [])
    return staff["researcher"].get(address).content.decode()


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
    assert "No worker has been running since 20 November 2026, 12:00 UTC." in found
    assert "goes on as soon as one starts" in found
    assert not is_worked_on(staff, job)
