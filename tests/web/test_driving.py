"""Simulating a job by its page, the table of driving scores, and the drives to look at."""

from collections.abc import Callable

import pytest
from django.urls import reverse

from augment.models import GenerationJob, Simulation
from tests.drives import driven, finished
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

OnCommit = Callable[..., object]


def launched(scenarios: int = 1) -> GenerationJob:
    return finished(rows.launch(scenarios=scenarios))


def test_the_button_plans_the_drives_and_queues_them(
    django_capture_on_commit_callbacks: OnCommit,
) -> None:
    job = launched(scenarios=2)
    admin = signed_in(people()["admin"])
    tab = reverse("job-tab", args=[job.code, "driving"])
    assert reverse("job-simulate", args=[job.code]) in admin.get(tab).content.decode()
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        answer = admin.post(reverse("job-simulate", args=[job.code]))
    assert answer.headers["Location"] == tab
    assert Simulation.objects.filter(state="queued").count() == 6
    assert len(waiting) == 1


@pytest.mark.parametrize("planner", ["pdm-open", "tests.jobs.test_simulations.Straight"])
def test_a_page_drives_with_the_projects_own_planners_alone(planner: str) -> None:
    job = launched()
    admin = signed_in(people()["admin"])
    sent = {"planner": planner}
    shown = admin.post(reverse("job-simulate", args=[job.code]), sent, follow=True)
    assert planner in shown.content.decode()
    assert not Simulation.objects.exists()


def test_the_jobs_page_shows_scores() -> None:
    job = launched()
    driven(job)
    researcher, page = signed_in(people()["researcher"]), f"/jobs/{job.code}/driving/"
    shown = researcher.get(page).content.decode()
    assert "own simulator unless a row says otherwise; n: drives" in shown
    assert "Mean driving score (%)" in shown
    assert "25.0" in shown
    assert "75.0" in shown
    assert "compare contestants" in shown
