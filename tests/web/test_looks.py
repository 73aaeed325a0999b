"""What pages say with colour, place and words beside their numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from django.conf import settings
from django.test import Client
from django.urls import reverse

from arena.models import Standing, Study
from arena.results.tree import ScenarioCost
from arena.services.ratings import rate
from augment.models import Contestant
from tests.full_study import Size, full_study
from tests.jobs.rows import add_kind, add_scenario
from tests.web.addresses import address
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db
TEMPLATES = Path(settings.BASE_DIR) / "templates"


def page(client: Client, url: str) -> str:
    return " ".join(client.get(url).content.decode().split())


@pytest.fixture
def rated() -> Study:
    found = full_study(size=Size(scenarios=10, experts=2, votes_per_expert=45))
    rate(study=found, rounds=50, seed=2)
    return found


def test_the_page_for_our_own_fault_has_the_styles_of_the_others() -> None:
    names = [
        set(re.findall(r"css/\w+\.css", (TEMPLATES / name).read_text()))
        for name in ("base.html", "alone.html")
    ]
    assert names[0] <= names[1]


@pytest.mark.parametrize("tab", ["table", "cost", "log"])
def test_results_belong_to_the_studies_in_the_menu(rated: Study, tab: str) -> None:
    shown = page(signed_in(people()["analyst"]), reverse("results-tab", args=[rated.code, tab]))
    assert re.search(r'aria-current="page">Studies</a>', shown)


def test_the_key_of_the_cost_charts_has_the_colours_of_their_points(rated: Study) -> None:
    Standing.objects.filter(slug="interplan").update(is_simulated=True)
    snapshot = rated.snapshots.get()
    line = ScenarioCost(
        slug="interplan", model="m", model_class="", augmentations=1, calls=1.0, tokens=12345.0,
        usd=None,
    )  # fmt: skip
    other = replace(line, slug="llama-otm", model_class="open_weight")
    snapshot.results = replace(snapshot.results, cost=(line, other))
    snapshot.save()
    shown = page(signed_in(people()["analyst"]), reverse("results-tab", args=[rated.code, "cost"]))
    keys = re.findall(r'<svg class="key ([\w -]+)".*?</svg>([^<]+)</span>', shown)
    assert keys == [
        ("g-none is-simulated", "class of the model unknown, simulated"),
        ("g-open_weight", "Open weight"),
    ]
    assert "12,345" in shown


def test_single_scenarios_are_folded_until_some_are_ticked() -> None:
    add_kind("rule-placer", Contestant.Kind.RULE)
    for slug in ("street", "square"):
        add_scenario(slug)
    admin, url = signed_in(people()["admin"]), reverse("job-new")
    assert '<details class="singles">' in page(admin, url)
    sent = {"name": "", "contestants": ["rule-placer"], "scenarios": ["street"]}
    assert '<details class="singles" open>' in admin.post(url, sent).content.decode()
    sent["scenarios"] = ["street", "square"]
    assert '<details class="singles">' in admin.post(url, sent).content.decode()


def test_every_page_of_a_section_marks_it_in_the_navigation() -> None:
    here = world()
    admin = signed_in(people()["admin"])
    rows = {
        "Home": ("home",),
        "Scenarios": (
            "scenarios",
            "scenario",
            "reference-edit",
            "scene",
            "scenario-new",
            "upload",
        ),
        "Contestants": ("contestants", "contestant", "endpoint-new", "endpoint-model"),
        "Jobs": ("jobs", "job-cancel", "analyses", "drives", "drive", "augmentation", "correct"),
        "Studies": ("study-plan", "import-votes", "study", "enrolment", "report", "study-close"),
        "People": ("people", "person-forget", "audit"),
        None: ("password", "api-tokens"),
    }
    for label, names in rows.items():
        for name in names:
            shown = admin.get(address(name, here)).content.decode()
            nav = shown.partition("<main")[0]
            found = re.findall(r'<a href="[^"]*" aria-current="page">([^<]*)</a>', nav)
            assert found == ([label] if label else []), name
