"""Simulating a job by its page, the table of driving scores, and the drives to look at."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from html.parser import HTMLParser

import pytest
from django.urls import reverse
from PIL import Image

from augment.models import GenerationJob, Simulation
from tests.drives import driven, finished
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

OnCommit = Callable[..., object]


class HTMLForm(HTMLParser):
    """What the fields of one form offer, by the form's class."""

    def __init__(self, css_class: str) -> None:
        super().__init__()
        self._class, self._inside, self._select = css_class, False, ""
        self.found: dict[str, list[str]] = {}

    @classmethod
    def named(cls, page: str, css_class: str) -> dict[str, list[str]]:
        made = cls(css_class)
        made.feed(page)
        return made.found

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        if tag == "form":
            self._inside = given.get("class") == self._class
        elif self._inside and tag == "select":
            self._select = given["name"]
        elif self._inside and tag == "option":
            self.found.setdefault(self._select, []).append(given["value"])
        elif self._inside and tag == "input" and given.get("type") != "hidden":
            self.found[given["name"]] = [given["value"]]


def launched(scenarios: int = 1) -> GenerationJob:
    return finished(rows.launch(scenarios=scenarios))


def test_the_button_plans_the_drives_and_queues_them(
    django_capture_on_commit_callbacks: OnCommit,
) -> None:
    job = launched(scenarios=2)
    admin = signed_in(people()["admin"])
    assert reverse("job-simulate", args=[job.code]) in (
        admin.get(reverse("job", args=[job.code])).content.decode()
    )
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        answer = admin.post(reverse("job-simulate", args=[job.code]))
    assert answer.headers["Location"] == reverse("job", args=[job.code]) + "?score=nuplan#driving"
    assert Simulation.objects.filter(state="queued").count() == 6
    assert len(waiting) == 1


def test_the_button_offers_what_the_command_does() -> None:
    job = launched()
    admin = signed_in(people()["admin"])
    page = reverse("job", args=[job.code])
    form = HTMLForm.named(admin.get(page).content.decode(), "drive-how")
    assert form == {
        "planner": ["pdm-closed", "idm"],
        "offsets": ["paper", "original"],
        "score": ["nuplan", "interplan"],
        "reactive": ["on"],
    }
    sent = {"planner": "pdm-closed", "offsets": "original", "reactive": "on", "score": "interplan"}
    shown = admin.post(reverse("job-simulate", args=[job.code]), sent, follow=True)
    assert shown.redirect_chain[0][0] == f"{page}?score=interplan#driving"
    rows_made = Simulation.objects.values_list("planner", "offsets", "is_reactive").distinct()
    assert set(rows_made) == {("pdm-closed", "original", True)}
    # Asked for in two ways, the page shows the latest and leads to the other.
    sent = {"planner": "idm", "offsets": "original", "score": "nuplan"}
    shown = admin.post(reverse("job-simulate", args=[job.code]), sent, follow=True)
    assert set(Simulation.objects.values_list("planner", "offsets", "is_reactive")) == {
        ("pdm-closed", "original", True), ("idm", "paper", False)
    }  # fmt: skip
    text = shown.content.decode()
    assert "Up to 1 m (original)" in text
    other = admin.get(page + "?driven=1&score=nuplan").content.decode()
    assert '<option value="original" selected>' in other
    assert admin.get(page + f"?driven={'9' * 5000}").status_code == 200


def test_a_score_that_nobody_knows_drives_nothing() -> None:
    job = launched()
    admin = signed_in(people()["admin"])
    shown = admin.post(reverse("job-simulate", args=[job.code]), {"score": "carla"}, follow=True)
    assert "carla" in shown.content.decode()
    assert not Simulation.objects.exists()


@pytest.mark.parametrize("planner", ["pdm-open", "tests.jobs.test_simulations.Straight"])
def test_a_page_drives_with_the_projects_own_planners_alone(planner: str) -> None:
    job = launched()
    admin = signed_in(people()["admin"])
    sent = {"planner": planner}
    shown = admin.post(reverse("job-simulate", args=[job.code]), sent, follow=True)
    assert planner in shown.content.decode()
    assert not Simulation.objects.exists()


def test_only_admins_simulate_and_only_staff_see_drives() -> None:
    job = launched()
    row = driven(job)[-1]
    cast = people()
    button = reverse("job-simulate", args=[job.code])
    assert signed_in(cast["analyst"]).post(button).status_code == 403
    pages = [
        reverse("drives", args=[job.code]),
        reverse("drive", args=[row.code]),
        reverse("drive-file", args=[row.code, "json"]),
        reverse("driving-export", args=[job.code, "csv"]),
    ]
    for page in pages:
        assert signed_in(cast["analyst"]).get(page).status_code == 200, page
        assert signed_in(cast["expert"]).get(page).status_code == 403, page


def test_the_jobs_page_shows_scores_and_on_request_the_papers() -> None:
    job = launched()
    driven(job)
    analyst, page = signed_in(people()["analyst"]), reverse("job", args=[job.code])
    assert "reported in the paper" not in analyst.get(page).content.decode()
    shown = analyst.get(page + "?paper=1").content.decode()
    assert "own simulator; n: drives" in shown
    assert "Mean driving score (%)" in shown
    assert "25.0" in shown
    assert "75.0" in shown
    assert "reported in the paper" in shown
    assert "51.9" in shown
    assert "compare contestants" in shown


def test_the_drives_of_a_job_lead_to_each_drive() -> None:
    job = launched()
    made = driven(job)
    shown = signed_in(people()["analyst"]).get(reverse("drives", args=[job.code])).content.decode()
    for row in made:
        assert reverse("drive", args=[row.code]) in shown


def test_a_drive_stands_beside_the_scene_before_its_change() -> None:
    before, *_, row = driven(launched())
    analyst = signed_in(people()["analyst"])
    shown = analyst.get(reverse("drive", args=[row.code])).content.decode()
    assert shown.count("<canvas") == 2
    for one in (before, row):
        assert reverse("drive-file", args=[one.code, "json"]) in shown
    trace = json.loads(analyst.get(reverse("drive-file", args=[row.code, "json"])).content)
    assert trace["format"] == "scenario-arena/drive"
    assert len(trace["plans"][0]["scores"]) == 10
    assert analyst.get(reverse("drive", args=[before.code])).content.decode().count("<canvas") == 1


@pytest.mark.parametrize(
    ("form", "kind", "frames", "size"),
    [
        # Before and after beneath each other and in step; a strip has a column of six for each.
        ("gif", "GIF", 7, (672, 2 * 288 + 3)),
        ("apng", "PNG", 7, (672, 2 * 288 + 3)),
        ("png", "PNG", 1, (2 * 672 + 3, 6 * 288 + 5 * 3)),
    ],
)
def test_a_drive_can_be_taken_away_as_pictures(
    form: str, kind: str, frames: int, size: tuple[int, int]
) -> None:
    row = driven(launched())[-1]
    answer = signed_in(people()["analyst"]).get(reverse("drive-file", args=[row.code, form]))
    picture = Image.open(io.BytesIO(answer.content))
    assert picture.format == kind
    assert getattr(picture, "n_frames", 1) == frames
    assert picture.size == size


def test_what_is_not_driven_yet_has_no_files() -> None:
    job = launched()
    row = driven(job)[-1]
    Simulation.objects.filter(pk=row.pk).update(state="failed", reason="it broke")
    analyst = signed_in(people()["analyst"])
    assert analyst.get(reverse("drive-file", args=[row.code, "json"])).status_code == 404
    assert "it broke" in analyst.get(reverse("drive", args=[row.code])).content.decode()


@pytest.mark.parametrize(
    ("form", "parts"),
    [
        ("csv", ["score_percent", "25.00", "own simulator"]),
        ("json", ['"format": "scenario-arena/driving"', '"lowered": 0.75']),
        ("latex", [r"\label{tab:driving_score}", "own simulator"]),
    ],
)
def test_the_table_as_a_file(form: str, parts: list[str]) -> None:
    job = launched()
    driven(job)
    analyst = signed_in(people()["analyst"])
    text = analyst.get(reverse("driving-export", args=[job.code, form])).content.decode()
    for part in parts:
        assert part in text
