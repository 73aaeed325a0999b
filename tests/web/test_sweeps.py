"""Sweeps and families on the pages and by the wire: started by admins, read by researchers."""

import csv
import io
import json
import re
from typing import Any

import pytest
from django.db import connection
from django.urls import reverse
from pytest_django import DjangoCaptureOnCommitCallbacks, Settings

from augment.baselines.rule_placer import place
from augment.models import Scenario, Simulation, Sweep
from augment.scene.codec import modification_to_document
from augment.services.driving import sweeps
from tests.api.tokens import program_of
from tests.jobs import rows
from tests.jobs.test_sweeps import ACROSS, STRAIGHT, drive_tested, parked, settle_others
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

FORM = {"number": ACROSS, "low": "2", "high": "3", "count": "2", "offsets": "paper"}


@pytest.fixture
def scenario(settings: Settings) -> Scenario:
    settings.PLANNERS = (STRAIGHT.planner,)
    document = modification_to_document(parked(0.0))
    return rows.add_scenario("parked", reference=document, intent=None, intent_origin="")


def test_a_sweep_is_started_followed_and_read(scenario: Scenario) -> None:
    cast = people()
    admin, researcher = signed_in(cast["admin"]), signed_in(cast["researcher"])
    listed = reverse("sweeps", args=[scenario.code])
    shown = admin.get(listed).content.decode()
    assert f"{ACROSS} (now 0)" in shown
    ids = re.findall(r' id="([^"]+)"', shown)
    assert len(ids) == len(set(ids)), "labels of both forms lead to their own fields"
    start = reverse("sweep-start", args=[scenario.code])
    asked = FORM | {"planner": STRAIGHT.planner}
    assert researcher.post(start, asked).status_code == 403
    assert "Values" in admin.post(start, asked | {"count": "1"}, follow=True).content.decode()
    refused = admin.post(start, asked | {"low": "7", "high": "3"}, follow=True).content.decode()
    assert "must be a number above low, got 7 to 3" in refused
    assert 'value="7"' in refused, "what was typed is still there"
    page = admin.post(start, asked).headers["Location"]
    assert "0 of 8 drives" in researcher.get(page).content.decode()
    settle_others(at_2=0.7)
    drive_tested()
    shown = researcher.get(page).content.decode()
    assert "passes 3 and fails 2" in shown
    assert "parked-1" in shown
    sweep = Sweep.objects.get()
    refined = reverse("sweeps", args=[scenario.code]) + f"?number={ACROSS}&low=2.0&high=3.0"
    assert 'value="2.0"' in admin.get(refined).content.decode()
    table = researcher.get(reverse("sweep-file", args=[sweep.code, "csv"])).content.decode()
    lines = list(csv.DictReader(io.StringIO(table)))
    own = [line for line in lines if line["driver"] == STRAIGHT.planner]
    assert [(line["value"], line["lawful"]) for line in own] == [("2.0", "no"), ("3.0", "yes")]
    chart = researcher.get(reverse("sweep-file", args=[sweep.code, "svg"])).content
    assert b"hardest solved" in chart
    drive = Simulation.objects.filter(planner=STRAIGHT.planner).first()
    assert drive is not None
    assert f"{ACROSS} = 2" in researcher.get(reverse("drive", args=[drive.code])).content.decode()
    remove = reverse("sweep-remove", args=[sweep.code])
    assert "Its drives are deleted with it" in admin.post(remove).content.decode()
    removed = admin.post(remove, {"sure": "1"})
    assert removed.headers["Location"] == listed
    assert not Simulation.objects.exists()
    assert Scenario.objects.filter(slug="parked-1").exists(), "what was kept stays"


def test_a_program_starts_a_sweep_and_reads_it(scenario: Scenario) -> None:
    cast = people()
    admin, researcher = program_of(cast["admin"]), program_of(cast["researcher"])
    address = f"/api/v1/scenarios/{scenario.code}/sweeps"

    def start(**body: Any) -> Any:
        return admin.post(address, json.dumps(body), content_type="application/json")

    assert start(number=ACROSS, low=2, high=3, count=1).status_code == 422
    assert start(number="add[9].y_m", low=2, high=3).status_code == 400
    answer = start(number=ACROSS, low=2, high=3, count=2, planner=STRAIGHT.planner)
    assert (answer.status_code, answer.json()["planned"]) == (202, 8)
    drive_tested()
    found = researcher.get(f"/api/v1/sweeps/{answer.json()['code']}").json()
    assert (found["edges"], found["under_way"], found["hardest"]) == ([[3.0, 2.0]], 6, None)
    own = [one for one in found["drives"] if one["driver"] == STRAIGHT.planner]
    assert [(one["value"], one["lawful"]) for one in own] == [(2.0, False), (3.0, True)]


def test_a_family_is_drawn_on_the_page_and_by_the_wire(
    scenario: Scenario, django_capture_on_commit_callbacks: DjangoCaptureOnCommitCallbacks
) -> None:
    ranged = json.loads(json.dumps(rows.add_scenario("cones").intent))
    ranged["requests"][0]["spot"]["distance"] = {"low_m": 20.0, "high_m": 40.0}
    first = Scenario.objects.get(slug="cones")
    Scenario.objects.filter(pk=first.pk).update(intent=ranged)
    researcher = people()["researcher"]
    draw = reverse("family-draw", args=[first.code])
    shown = signed_in(researcher).post(draw, {"count": "3", "seed": "1"}, follow=True)
    assert "3 added: cones-1 to cones-3" in shown.content.decode()
    body = json.dumps({"count": 1, "seed": 2})
    address = f"/api/v1/scenarios/{first.code}/family"
    with django_capture_on_commit_callbacks() as sent:
        answer = program_of(researcher).post(address, body, content_type="application/json")
    family = {"scenarios": ["cones-4"], "refused": [], "warnings": []}
    assert (answer.status_code, answer.json(), len(sent)) == (201, family, 1)
    told = signed_in(researcher).post(
        reverse("family-draw", args=[scenario.code]), {"count": "3", "seed": "1"}, follow=True
    )
    assert "no intent" in told.content.decode()


@pytest.mark.django_db(transaction=True)
def test_no_lock_is_held_while_values_are_placed(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings.PLANNERS = (STRAIGHT.planner,)
    locks: list[bool] = []

    def noting(*given: Any, **more: Any) -> Any:
        locks.append(connection.in_atomic_block)
        return place(*given, **more)

    monkeypatch.setattr(sweeps, "place", noting)
    scenario, admin = rows.add_scenario("cones"), people()["admin"]
    given = {"number": "requests[0].spot.distance", "low": 20, "high": 30, "count": 2}
    form = given | {"planner": STRAIGHT.planner, "offsets": "paper"}
    signed_in(admin).post(reverse("sweep-start", args=[scenario.code]), form)
    address = f"/api/v1/scenarios/{scenario.code}/sweeps"
    program_of(admin).post(address, json.dumps(given), content_type="application/json")
    assert locks == [False] * 4
    assert Sweep.objects.count() == 2
