"""What became of a job on its pages: displacement, findings, drives, prompts and sweeps."""

import csv
import html
import io
import json
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from django.db import connection
from django.test import Client
from django.urls import reverse
from django.utils.html import escape
from pytest_django import DjangoAssertNumQueries, DjangoCaptureOnCommitCallbacks, Settings

from augment.baselines.rule_placer import place
from augment.models import Augmentation, GenerationJob, ModelCall, Scenario, Simulation, Sweep
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.services.driving import sweeps
from augment.services.judging.analyses import count_unmeasured
from augment.services.judging.findings import check_augmentation
from augment.services.scenarios.prompts import preview_prompt
from augment.tasks import draw, measure
from tests import intents
from tests.api.tokens import program_of
from tests.drives import driven, finished
from tests.exports.test_displacement import a_job, add_moving
from tests.jobs import rows
from tests.jobs.rows import add_scenario
from tests.jobs.scripted import Scripted, add, run
from tests.jobs.test_sweeps import ACROSS, STRAIGHT, drive_tested, parked, settle_others
from tests.llm.json_server import serving
from tests.scenes import vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def displacement_of(job: GenerationJob, query: str = "") -> str:
    measure(job.pk)
    shown = signed_in(people()["researcher"]).get(f"/jobs/{job.code}/displacement/{query}")
    text = re.sub(r"<[^>]+>", " ", shown.content.decode())
    return re.sub(r"\s+", " ", text)


def page_of(row: Augmentation, role: str = "researcher") -> str:
    return signed_in(people()[role]).get(reverse("augmentation", args=[row.code])).content.decode()


def crash() -> Augmentation:
    """A car that stands in the ego, where the reference has two cones."""
    job = GenerationJob.objects.create(name="Round 1")
    into_the_ego = Modification(added=(vehicle("Agent2", 1.0, 0.0),))
    return rows.add_answer(job, rows.add_scenario("one"), rows.add_kind("ann"), into_the_ego)


def test_a_jobs_page_shows_the_error_of_every_contestant_and_marks_the_simulated() -> None:
    shown = displacement_of(a_job())
    assert re.search(r"ann 0\.75 0\.75 \d, \d 2\.00 2\.00 to 2\.00 2\.00 2 2 0", shown)
    assert re.search(r"sim simulated – – [1-9], 0 – – – 0 4 0", shown)
    assert "All five scenario types." in shown


@pytest.mark.slow
def test_what_is_not_measured_yet_is_left_to_a_worker_and_then_kept(
    django_assert_max_num_queries: DjangoAssertNumQueries,
    monkeypatch: pytest.MonkeyPatch,
    researcher: Client,
) -> None:
    job = a_job()
    address = f"/jobs/{job.code}/displacement/"
    assert (
        "A worker measures the results: 4 of 4 are left"
        in researcher.get(address).content.decode()
    )
    for name in ("displacement-by-type", "realism", "augmentations"):
        file = researcher.get(f"/jobs/{job.code}/files/{name}.csv")
        assert (file.status_code, file["Location"]) == (302, address)
    measure(job.pk)
    with django_assert_max_num_queries(40):
        assert "A worker measures" not in researcher.get(address).content.decode()
    draw("job", job.pk)
    monkeypatch.setattr("augment.metrics.paired.compare_all", None)  # no bootstrap, no drawing
    monkeypatch.setattr("arena.jobs.exports.displacement.write_figure", None)
    for path in (
        *("analyses/", "files/analyses-pairs.csv", "files/displacement-by-contestant.svg"),
        *("files/displacement-by-type.png", "files/displacement-by-variant.pdf"),
    ):
        assert researcher.get(f"/jobs/{job.code}/{path}").status_code == 200, path
    scenario = job.augmentations.earliest("pk").scenario
    scenario.reference = modification_to_document(Modification(added=(vehicle("c", 9.0, 0.0),)))
    scenario.save()
    stale = job.augmentations.filter(scenario=scenario).count()
    assert count_unmeasured(job) == stale  # another reference: what it was held against is gone


def test_what_moves_has_columns_of_its_own() -> None:
    job, reader = a_job(), signed_in(people()["researcher"])

    def read(path: str) -> str:
        text = re.sub(r"<[^>]+>", " ", reader.get(path).content.decode())
        return re.sub(r"\s+", " ", text)

    measure(job.pk)
    assert "At t0 (m)" not in read(f"/jobs/{job.code}/displacement/")
    row = add_moving(job)
    measure(job.pk)
    shown = read(f"/jobs/{job.code}/displacement/")
    assert "Mean (m) At t0 (m) After 6 s (m) Starts apart (s) Matched" in shown
    assert "bea – – – 2.91 2.91 to 2.91 2.91 0.00 5.00 1.00 1 0 0" in shown
    assert re.search(r"ann 0\.75 .* 2\.00 2\.00 to 2\.00 2\.00 – – – 2 2 0", shown)
    found = read(reverse("augmentation", args=[row.code]))
    assert "and the 6 s after t0; at t0 0.00 m, after them 5.00 m" in found
    assert "The motion of Agent2 begins after 3.0 s" in found


def test_an_augmentations_page_says_what_is_wrong_with_it_and_how_far_it_is() -> None:
    shown = page_of(crash())
    assert "Agent2 and Agent1 overlap by" in shown
    assert "Nothing stands for what the instruction asks for; 1 missing; 1 more than" in shown
    assert "No object could be matched with the reference; 2 missing; 1 more" in shown
    assert "plain measurement" in shown


def test_a_row_that_cannot_be_read_says_so_instead_of_breaking_its_page() -> None:
    row = crash()
    Augmentation.objects.filter(pk=row.pk).update(modification={})
    shown = page_of(row)
    assert "The checks could not run." in shown
    assert "its stored modification can&#x27;t be read" in shown


FAR = intent_to_document(intents.parked(40.0))


@pytest.fixture
def row() -> Augmentation:
    """Two cones where a parked car is asked for."""
    found = rows.only_row(rows.launch())
    rows.leased(found).settle(rows.done(), now=rows.NOON)
    found.scenario.intent = FAR
    found.scenario.save(update_fields=["intent"])
    return Augmentation.objects.select_related("contestant", "scenario__base_scene").get()


def test_the_page_names_everybody_in_a_picture_for_staff_alone(row: Augmentation) -> None:
    staff, url = people(), reverse("augmentation", args=[row.code])
    researcher = signed_in(staff["researcher"])
    displacement_of = researcher.get(url).content.decode()
    picture = reverse("picture", args=["labelled", row.code])
    assert picture in displacement_of
    found = check_augmentation(row)
    assert found is not None
    assert [line.kind for line in found.faults][:2] == ["asked_count", "asked_type"]
    assert all(escape(line.sentence()) in displacement_of for line in found.faults)
    assert researcher.get(picture).content[:4] == b"\x89PNG"
    assert signed_in(staff["expert"]).get(picture).status_code == 403


OnCommit = Callable[..., object]


def launched(scenarios: int = 1) -> GenerationJob:
    return finished(rows.launch(scenarios=scenarios))


def test_the_button_plans_the_drives_and_queues_them(
    django_capture_on_commit_callbacks: OnCommit, admin: Client
) -> None:
    job = launched(scenarios=2)
    tab = reverse("job-tab", args=[job.code, "driving"])
    assert reverse("job-simulate", args=[job.code]) in admin.get(tab).content.decode()
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        answer = admin.post(reverse("job-simulate", args=[job.code]))
    assert answer.headers["Location"] == tab
    assert Simulation.objects.filter(state="queued").count() == 6
    assert len(waiting) == 1


def test_a_page_drives_with_the_projects_own_planners_alone(admin: Client) -> None:
    job, planner = launched(), "tests.jobs.test_simulations.Straight"
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


@pytest.fixture
def server() -> Iterator[Scripted]:
    with serving(Scripted()) as started:
        yield started


@pytest.mark.parametrize(
    ("variant", "options"),
    [
        *(("otm", {}), ("tqa", {}), ("fc", {}), ("fc", {"protocol": "native"})),
        *(("fc-plus", {}), ("fc-plus", {"protocol": "native"})),
    ],
)
def test_the_page_shows_what_the_wire_then_carries(
    researcher: Client, server: Scripted, variant: str, options: dict[str, object]
) -> None:
    add(server, "asked", variant, **options)
    [row] = run("asked")
    asked = {"variant": variant} | ({"native": "1"} if options else {})
    sent = server.bodies[0]
    preview = preview_prompt(
        row.scenario, variant=variant, role="modifier", native_tools=bool(options)
    )
    assert [json.loads(tool) for tool in preview.tools] == sent.get("tools", [])
    page = researcher.get(reverse("prompts", args=[row.scenario.code]), asked).content.decode()
    shown = [
        html.unescape(one) for one in re.findall(r"<pre data-message[^>]*>(.*?)</pre>", page, re.S)
    ]
    assert shown == [message["content"] for message in sent["messages"]]
    assert re.search(r"About [\d,]+ tokens of text", page)


def test_a_viewer_s_picture_is_shown_and_nobody_is_asked(researcher: Client) -> None:
    here = add_scenario("street")
    asked = {"variant": "vqa", "role": "viewer"}
    url = reverse("prompts", args=[here.code])
    shown = researcher.get(url, asked).content.decode()
    assert "In which lane does each blue object stand?" in html.unescape(shown)
    picture = researcher.get(reverse("prompt-image", args=[here.code, 0]), asked)
    assert picture.content.startswith(b"\x89PNG")
    assert not ModelCall.objects.exists()


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
