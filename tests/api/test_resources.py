"""Resources of the wire: the services, roles and bytes of pages; studies; lists with ETags."""

import json
from dataclasses import asdict
from typing import Any

import pytest
from django.conf import LazySettings
from django.contrib.auth.models import User
from django.core.files.uploadedfile import SimpleUploadedFile
from django.db import connection
from django.test import Client
from django.test.utils import CaptureQueriesContext
from django.urls import reverse

from arena.models import Invitation, Snapshot, Study
from arena.people.links import revoke
from arena.people.services import make_first_link_token
from arena.results.services.ratings import open_early
from arena.results.services.ratings import rate_now as rate
from arena.site.api_urls import urlpatterns
from arena.studies.api import StudyBody
from arena.studies.services.opening import close_study
from arena.studies.services.plan import PLAN_INPUTS, StudyPlan
from augment.models import (
    BaseScene,
    Contestant,
    Event,
    GenerationJob,
    Probe,
    Scenario,
    SceneUpload,
)
from augment.scene.codec import modification_to_document, scene_to_document
from augment.scene.entities import Modification
from augment.services.endpoints import (
    ContestantRequest,
    EndpointRequest,
    add_contestant,
    ensure_endpoint,
)
from augment.services.endpoints.probing import ABILITIES
from augment.services.inputs import InputKind
from augment.services.scenarios import uploads
from tests.api.asking import error_of
from tests.api.tokens import program, program_of
from tests.jobs import rows
from tests.jobs.rows import add_scenario
from tests.opening import open_study
from tests.scenes import scene, vehicle
from tests.study_rows import (
    a_study,
    cast_of,
    contestant,
    expert,
    matchups_of,
    picture,
    scenario,
    vote,
)
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db


API = "/api/v1/"
STREET = json.dumps(scene_to_document(scene(agents=(vehicle("Agent2", 20.0, 0.0),)))).encode()
CAR = modification_to_document(Modification(added=(vehicle("Added1", 20.0, 0.4),)))


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Messages to the workers, as kind and key; nobody takes them but the test."""
    found: list[tuple[str, int]] = []
    monkeypatch.setattr(
        "arena.shell.sending.enqueue_row", lambda row: found.append((row._meta.model_name, row.pk))
    )
    monkeypatch.setattr("arena.api.views.transaction.on_commit", lambda done: done())
    return found


@pytest.fixture
def reader() -> Client:
    return program_of(people()["researcher"])


@pytest.fixture
def admin() -> Client:
    return program_of(people()["admin"])


def send(client: Client, path: str, **body: object) -> Any:
    return client.post(API + path, body, content_type="application/json")


def upload(client: Client, content: bytes = STREET, **fields: object) -> Any:
    file = SimpleUploadedFile("street.json", content)
    return client.post(API + "uploads", {"file": file, **fields})


# --- Scenes ------------------------------------------------------------------------------------


def test_a_recording_becomes_a_scene(reader: Client, sent: list[tuple[str, int]]) -> None:
    answer = upload(reader)
    assert answer.status_code == 202, answer.content
    made = answer.json()
    assert (made["state"], made["tracks"], made["warnings"]) == ("queued", [], [])
    assert sent == [("sceneupload", SceneUpload.objects.get().pk)]
    uploads.UPLOADS.perform(sent.pop()[1])
    path = f"uploads/{made['code']}"
    found = reader.get(API + path).json()
    assert (found["state"], len(found["tracks"])) == ("read", 1)
    (stop,) = found["tracks"][0]["stops"]
    asked = {name: stop[name] for name in ("item", "frame")}
    moment = send(reader, path + "/moments", **asked).json()
    assert send(reader, path + "/moments", **asked).json()["code"] == moment["code"]
    here = f"moments/{moment['code']}"
    drawn = reader.get(API + here).json()
    assert (drawn["state"], drawn["report"]["agents"], drawn["scene"]) == ("drawn", 1, None)
    error_of(send(reader, path + "/moments", **asked, slug="No Slug"), 400, "refused")
    kept = send(reader, path + "/moments", **asked, slug="main-street")
    assert (kept.status_code, kept.json()["code"]) == (202, moment["code"])
    uploads.MOMENTS.perform(sent.pop()[1])
    assert reader.get(API + here).json()["scene"] == "main-street"
    assert BaseScene.objects.get().slug == "main-street"


def test_a_file_that_can_not_be_taken_is_refused_before_anything_is_kept(
    reader: Client, settings: LazySettings
) -> None:
    assert list(error_of(upload(reader, format="laser"), 422, "invalid")["fields"]) == ["format"]
    empty = reader.post(API + "uploads", {"format": ""})
    assert "file" in error_of(empty, 422, "invalid")["fields"]
    error_of(send(reader, "uploads", file="x"), 415, "unsupported_media_type")
    settings.UPLOAD_MB = 1
    error_of(upload(reader, b" " * 1_000_001), 413, "too_large")
    assert not SceneUpload.objects.exists()


# --- Scenarios ---------------------------------------------------------------------------------


def test_a_scenario_is_added_with_a_reference_that_fits(
    reader: Client, sent: list[tuple[str, int]]
) -> None:
    add_scenario("street", reference=None)
    given = {"scene": "street-scene", "type": "cut_in", "instruction": "Place a car ahead."}
    error_of(send(reader, "scenarios", **given, goal="back"), 422, "invalid")
    error_of(send(reader, "scenarios", **given, reference={"add": "a car"}), 400, "refused")
    error_of(send(reader, "scenarios", **given, intent={"version": "x"}), 400, "refused")
    assert (Scenario.objects.count(), sent) == (1, [])
    chosen = {"slug": "mine", "density": "low", "goal": "left", "reference": CAR}
    made = send(reader, "scenarios", **given, **chosen).json()
    assert (made["slug"], made["type"], made["has_reference"]) == ("mine", "cut_in", True)
    row = Scenario.objects.get(slug="mine")
    assert (row.keep_traffic, row.traffic_density, row.goal) == (False, "low", "left")
    assert row.reference is not None
    assert sent == [("scenario", row.pk)]


# --- Endpoints and models ----------------------------------------------------------------------


def test_a_model_of_a_new_endpoint_is_probed(admin: Client, sent: list[tuple[str, int]]) -> None:
    given = {"label": "here", "base_url": "http://127.0.0.1:9/v1", "max_concurrency": 3}
    made = send(admin, "endpoints", **given, requests_per_minute=60).json()
    assert (made["max_concurrency"], made["requests_per_minute"]) == (3, 60)
    error_of(send(admin, "endpoints", **given), 409, "conflict")
    model = send(admin, f"endpoints/{made['code']}/models", model="m").json()
    assert (model["endpoint"], model["price_in_usd"]) == ("here", None)
    there = f"models/{model['code']}/probe"
    assert sent == [("probe", Probe.objects.get().pk)]
    error_of(send(admin, there), 409, "conflict")
    Probe.objects.update(state=Probe.State.DONE)
    answer = send(admin, there)
    assert (answer.status_code, len(answer.json()["lines"])) == (202, len(ABILITIES))
    assert {line["progress"] for line in answer.json()["lines"]} == {"waiting"}
    assert admin.get(API + there).json()["state"] == "queued"


OF_EXPERTS = {
    *("api-first", "api-welcome", "api-studies", "api-matchups"),
    *("api-picture", "api-preferences", "api-reports", "api-votes"),
}
OPEN_TO_THE_WORLD = ("api-first", "api-welcome")


def slugs(page: Any) -> list[str]:
    return [row["slug"] for row in page.json()["results"]]


# --- Lists -------------------------------------------------------------------------------------


def test_pages_lose_no_row_and_repeat_none_while_rows_are_added() -> None:
    study = a_study()
    asking = program_of(people()["researcher"])
    first = asking.get(API + "scenarios", {"limit": 4})
    study.scenarios.filter(slug="place-0").update(slug="a-new-first-one")
    second = asking.get(first.json()["next"])
    assert slugs(first) == ["place-0", "place-1", "place-2", "place-3"]
    assert slugs(second) == ["place-4", "place-5"]
    assert second.json()["next"] is None


def test_what_has_not_changed_is_304_and_what_has_is_not() -> None:
    job = rows.launch(scenarios=2, contestants=("reference",))
    asking = program_of(people()["researcher"])
    for path in ("jobs", f"jobs/{job.code}", f"jobs/{job.code}/progress"):
        tag = asking.get(API + path).headers["ETag"]
        again = asking.get(API + path, headers={"If-None-Match": tag})
        assert (again.status_code, again.content) == (304, b"")
    job.augmentations.update(state="failed", reason="x")
    assert asking.get(API + path, headers={"If-None-Match": tag}).status_code == 200


def test_a_list_asks_the_database_as_often_whatever_is_in_it() -> None:
    asking = program_of(people()["admin"])
    rows.launch(scenarios=1, contestants=("reference",))
    study = a_study()
    few = {
        path: _queries(asking, path) for path in ("jobs", "scenarios", "contestants", "studies")
    }
    for number in range(3):
        expert(f"new-{number}")
        place, who = scenario(f"new-{number}"), contestant(f"new-{number}")
        picture(place, who)
    open_study(
        name="Round 2",
        contestants=list(study.contestants.values_list("slug", flat=True)),
        scenarios=[f"place-{number}" for number in range(6)],
        experts=["eva", "finn"],
        votes_per_expert=9,
        seed=1,
    )
    assert {path: _queries(asking, path) for path in few} == few


def _queries(client: Client, path: str) -> int:
    client.get(API + path)
    with CaptureQueriesContext(connection) as seen:
        assert client.get(API + path).status_code == 200
    return len(seen)


def test_a_contestant_is_told_in_full_to_staff_alone() -> None:
    ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    add_contestant(
        ContestantRequest(
            slug="one", variant="otm", endpoint="here", model="m", options={"temperature": 0.7}
        )
    )
    accounts = people()
    address_of = reverse("api-contestants")
    assert signed_in(accounts["expert"]).get(address_of).status_code == 403
    (found,) = signed_in(accounts["researcher"]).get(address_of).json()["results"]
    assert (found["slug"], found["retired_at"]) == ("one", None)
    assert (found["options"], found["frozen_options"]) == ({"temperature": 0.7}, None)
    assert (found["endpoint"], found["model"], found["roles"]) == ("here", "m", {})


# --- Changes -----------------------------------------------------------------------------------


def test_a_job_is_launched_by_the_pages_own_service(
    django_capture_on_commit_callbacks: Any,
) -> None:
    rows.launch(scenarios=2, contestants=("reference",))
    asking = program_of(people()["admin"])
    known = slugs(asking.get(API + "scenarios"))
    chosen = {"contestants": ["reference"], "scenarios": known}
    assert send(asking, "jobs/estimate", **chosen).json()["rows"] == len(known)
    with django_capture_on_commit_callbacks() as later:
        answer = send(asking, "jobs", name="By API", samples=2, cap_calls=5, **chosen)
    assert answer.status_code == 201, answer.content
    assert len(later) == 1, "the messages are sent once all is written"
    job = GenerationJob.objects.get(code=answer.json()["code"])
    assert (job.name, job.samples, job.cap_calls) == ("By API", 2, 5)
    assert job.augmentations.count() == answer.json()["total"] == 2 * len(known)
    event = Event.objects.get(verb="launch", object_code=str(job.code))
    assert event.actor is not None


def test_links_let_in_once_and_only_with_a_password_that_holds() -> None:
    link = f"http://x/first/{make_first_link_token()}/"
    given = {"link": link, "username": "ada"}
    error_of(send(Client(), "first", **given, password="short"), 400, "refused")
    made = send(Client(), "first", **given, password="nine lives of a cat")
    admin = program(made.json()["token"])
    error_of(send(Client(), "first", **given, password="nine lives of a cat"), 410, "link_over")
    grace = send(admin, "people", username="grace", role="researcher").json()
    invited = {"link": grace["link"], "password": "a bird in the hand"}
    for weak in ({"link": grace["link"]}, invited | {"password": "1"}):
        error_of(send(Client(), "welcome", **weak), 400, "refused")
    assert send(Client(), "welcome", **invited).json()["token"]
    error_of(send(Client(), "welcome", **invited), 410, "link_over")
    assert User.objects.get(username="grace").check_password("a bird in the hand")
    eva = send(admin, "people", username="eva", role="expert").json()
    expert = program(send(Client(), "welcome", link=eva["link"]).json()["token"])
    assert expert.get(API + "studies").status_code == 200
    assert expert.get(API + "jobs").status_code == 403
    revoke(invitation=Invitation.objects.get())
    assert expert.get(API + "studies").status_code == 401
    error_of(send(Client(), "welcome", link=eva["link"]), 410, "link_over")


# --- Blindness ---------------------------------------------------------------------------------


def address_of(name: str) -> str:
    here = {"code": "9e107d9d-372b-4682-86d0-5c1f9f3b2b1e", "name": "tool-calls", "form": "csv"}
    found = next(pattern for pattern in urlpatterns if pattern.name == name)
    wanted = found.pattern.converters
    return reverse(name, kwargs={part: here.get(part, "x") for part in wanted})


def test_experts_and_strangers_are_refused_before_anything_is_looked_up() -> None:
    asking = program_of(people()["expert"])
    for pattern in urlpatterns:
        assert pattern.name is not None
        address = address_of(pattern.name)
        for method in ("get", "post"):
            if pattern.name not in OF_EXPERTS:
                assert getattr(asking, method)(address).status_code in (403, 405), address
            if pattern.name not in OPEN_TO_THE_WORLD:
                assert getattr(Client(), method)(address).status_code in (401, 405), address


def test_an_experts_studies_tell_of_no_contestant() -> None:
    here = world()
    expert = program_of(here.expert)
    answer = expert.get(API + "studies")
    (line,) = answer.json()["results"]
    assert (line["planned"], line["voted"], line["left"]) == (9, 0, 9)
    of_both = {"code", "name", "state", "opened_at", "closed_at"}
    assert set(line) == of_both | {"planned", "voted", "skipped", "left"}
    assert program_of(people()["expert"]).get(API + "studies").json()["results"] == []


def test_a_researcher_reads_and_rates_and_changes_nothing_else() -> None:
    here = world()
    researcher = program_of(people()["researcher"])
    for path in ("jobs", f"studies/{here.study.code}/close", "people", "endpoints"):
        error_of(send(researcher, path), 403, "forbidden")
    close_study(study=here.study)
    assert send(researcher, f"studies/{here.study.code}/snapshots", rounds=100).status_code == 201


def test_results_of_an_open_study_need_an_early_look() -> None:
    here, accounts = world(), people()
    snapshot = rate(study=here.study, rounds=20, early=True)
    asking, rating = program_of(accounts["researcher"]), f"studies/{here.study.code}/snapshots"
    paths = [f"snapshots/{snapshot.code}", f"snapshots/{snapshot.code}/exports/leaderboard.csv"]
    for path in paths:
        error_of(asking.get(API + path), 403, "study_still_open")
    error_of(send(asking, rating), 403, "study_still_open")
    assert Snapshot.objects.count() == 1
    open_early(study=here.study, actor=accounts["researcher"])
    for path in paths:
        assert asking.get(API + path).status_code == 200
    assert send(asking, rating, rounds=100).json()["is_early"] is True
    error_of(program_of(accounts["admin"]).get(API + paths[0]), 403, "study_still_open")


def test_a_program_of_an_expert_sees_the_pictures_of_its_own_pairs_alone() -> None:
    here = world()
    own = here.study.matchups.filter(expert=here.expert)[0]
    other = here.study.matchups.exclude(expert=here.expert)[0]
    expert = program_of(here.expert)
    (pair, *_) = expert.get(API + "matchups", {"study": str(here.study.code)}).json()
    token = pair["a"].rpartition("/")[2]
    assert token == own.left_token
    picture = expert.get(f"{API}pictures/{token}")
    assert picture.content.startswith(b"\x89PNG")
    assert "ETag" not in picture.headers, "it would tell which pictures are alike"
    error_of(expert.get(f"{API}pictures/{other.left_token}"), 404, "not_found")


# --- Files -------------------------------------------------------------------------------------


def test_files_have_the_bytes_of_the_pages() -> None:
    here, admin = world(), people()["admin"]
    for matchup in matchups_of(here.study, "eva"):
        vote(matchup, "left")
    snapshot = rate(study=close_study(study=here.study), rounds=20)
    asking, page = program_of(admin), signed_in(admin)
    for name, form in (("leaderboard", "latex"), ("votes", "csv"), ("pairs", "svg")):
        program_file = asking.get(f"{API}snapshots/{snapshot.code}/exports/{name}.{form}")
        shown = page.get(f"/studies/{here.study.code}/rating/{name}.{form}")
        assert program_file.content == shown.content
        assert program_file.headers["Content-Type"] == shown.headers["Content-Type"]
    missing = asking.get(f"{API}snapshots/{snapshot.code}/exports/leaderboard.docx")
    error_of(missing, 404, "not_found")
    table = asking.get(f"{API}snapshots/{snapshot.code}").json()["table"]
    assert {row["slug"] for row in table["rows"]} == set(
        Contestant.objects.filter(studies=here.study).values_list("slug", flat=True)
    )


def test_every_field_of_a_plan_can_be_given_and_left_out_is_as_in_the_plan() -> None:
    given: dict[str, Any] = {
        **{"name": "x", "contestants": ["ann"], "scenarios": ["place"], "experts": ["eva"]},
        **{"votes_per_expert": 7, "seed": 2, "samples": "all", "jobs": ["Round 1"]},
        **dict.fromkeys(("repeats", "checks", "overlap"), 25.0),
        "hypotheses": ["ann above bob"],
        "questions": ["realism", "instruction"],
    }
    given |= {one.name: not one.default for one in PLAN_INPUTS if one.kind is InputKind.SWITCH}
    body = StudyBody(data=given)
    assert body.is_valid(), body.errors
    plan = StudyPlan.read(body.validated_data)
    assert {
        name: list(v) if isinstance(v, tuple) else v for name, v in asdict(plan).items()
    } == given
    least = {"name": "x", "contestants": [], "scenarios": [], "experts": [], "votes_per_expert": 1}
    body = StudyBody(data=least)
    assert body.is_valid(), body.errors
    assert StudyPlan.read(body.validated_data) == StudyPlan.read(least)


def test_a_preregistered_study_is_opened_by_the_wire() -> None:
    admin, lines = program_of(people()["admin"]), ["ann above bob", "Nobody is perfect."]
    given = {**cast_of(), "name": "Preregistered", "votes_per_expert": 6, "overlap": 50}
    refused = send(admin, "studies", **given, hypotheses=["ann above zoe"])
    assert "zoe" in error_of(refused, 400, "refused")["message"]
    answer = send(admin, "studies", **given, hypotheses=lines)
    assert answer.status_code == 201, answer.content
    study = Study.objects.get()
    assert [one["above"] for one in study.rules["hypotheses"]] == [["ann", "bob"], None]
    assert study.rules["overlap_share"] == 0.5
