"""Scenes, scenarios, endpoints and models are made by the wire as on the pages."""

from __future__ import annotations

import json
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import pytest
from django.conf import LazySettings
from django.core.files.uploadedfile import SimpleUploadedFile
from django.test import Client

from augment.models import (
    Augmentation,
    BaseScene,
    Contestant,
    Endpoint,
    EndpointModel,
    IntentReading,
    Probe,
    Scenario,
    SceneUpload,
)
from augment.scene.codec import modification_to_document, scene_to_document
from augment.scene.modification import Modification
from augment.services.endpoints import editing
from augment.services.running import runner
from augment.services.scenarios import upload_moments, uploads
from tests.api.asking import error_of
from tests.api.tokens import program_of
from tests.jobs.rows import add_scenario, launch
from tests.scenes import scene, vehicle
from tests.web.cast import people

pytestmark = pytest.mark.django_db

API = "/api/v1/"
STREET = json.dumps(scene_to_document(scene(agents=(vehicle("Agent2", 20.0, 0.0),)))).encode()
CAR = modification_to_document(Modification(added=(vehicle("Added1", 20.0, 0.4),)))
AWAY = modification_to_document(Modification(added=(vehicle("Added1", 20.0, 400.0),)))


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Messages to the workers, as task and key; nobody takes them but the test."""
    found: list[tuple[str, int]] = []
    for place, name in (
        ("uploads", "enqueue_upload"),
        ("uploads", "enqueue_moment"),
        ("scenarios", "enqueue_scenario"),
        ("scenario_changes", "enqueue_scenario"),
        ("scenario_changes", "enqueue_reading"),
        ("endpoint_models", "enqueue_probe"),
        ("augmentations", "enqueue_job"),
    ):
        monkeypatch.setattr(f"arena.api.{place}.{name}", _noting(found, name))
    monkeypatch.setattr("arena.api.sending.transaction.on_commit", lambda done: done())
    return found


def _noting(found: list[tuple[str, int]], name: str) -> Callable[[int], None]:
    return lambda pk: found.append((name, pk))


@pytest.fixture
def analyst() -> Client:
    return program_of(people()["analyst"])


@pytest.fixture
def admin() -> Client:
    return program_of(people()["admin"])


def send(client: Client, path: str, **body: object) -> Any:
    return client.post(API + path, body, content_type="application/json")


def upload(client: Client, content: bytes = STREET, **fields: object) -> Any:
    file = SimpleUploadedFile("street.json", content)
    return client.post(API + "uploads", {"file": file, **fields})


# --- Scenes ------------------------------------------------------------------------------------


def test_a_recording_becomes_a_scene(analyst: Client, sent: list[tuple[str, int]]) -> None:
    answer = upload(analyst)
    assert answer.status_code == 202, answer.content
    made = answer.json()
    assert (made["state"], made["tracks"], made["warnings"]) == ("queued", [], [])
    assert sent == [("enqueue_upload", SceneUpload.objects.get().pk)]
    uploads.read_upload(sent.pop()[1])
    path = f"uploads/{made['code']}"
    found = analyst.get(API + path).json()
    assert (found["state"], len(found["tracks"])) == ("read", 1)
    (stop,) = found["tracks"][0]["stops"]
    asked = {name: stop[name] for name in ("item", "frame")}
    moment = send(analyst, path + "/moments", **asked).json()
    assert send(analyst, path + "/moments", **asked).json()["code"] == moment["code"]
    assert len(sent) == 1, "the same moment twice is drawn once"
    upload_moments.work_on_moment(sent.pop()[1])
    here = f"moments/{moment['code']}"
    drawn = analyst.get(API + here).json()
    assert (drawn["state"], drawn["report"]["agents"], drawn["scene"]) == ("drawn", 1, None)
    assert analyst.get(f"{API}{here}/picture").content.startswith(b"\x89PNG")
    error_of(send(analyst, here + "/keep", slug="No Slug"), 400, "refused")
    assert send(analyst, here + "/keep", slug="main-street").status_code == 202
    upload_moments.work_on_moment(sent.pop()[1])
    assert analyst.get(API + here).json()["scene"] == "main-street"
    (line,) = analyst.get(API + "scenes").json()["results"]
    whole = analyst.get(f"{API}scenes/{line['code']}").json()
    assert (whole["slug"], whole["agents"], whole["scenarios"]) == ("main-street", 1, 0)
    assert send(analyst, path + "/remove").status_code == 200
    assert not SceneUpload.objects.exists()
    assert BaseScene.objects.exists()


def test_what_can_not_be_read_says_why_and_is_read_again(
    analyst: Client, sent: list[tuple[str, int]]
) -> None:
    code = upload(analyst, b"hello").json()["code"]
    uploads.read_upload(sent.pop()[1])
    found = analyst.get(f"{API}uploads/{code}").json()
    assert found["state"] == "failed"
    assert "none of the formats" in found["reason"]
    assert send(analyst, f"uploads/{code}/again").json()["state"] == "queued"
    error_of(send(analyst, f"uploads/{code}/again"), 409, "conflict")
    error_of(send(analyst, f"uploads/{code}/moments", frame=7), 409, "conflict")


def test_a_file_that_can_not_be_taken_is_refused_before_anything_is_kept(
    analyst: Client, settings: LazySettings
) -> None:
    assert list(error_of(upload(analyst, format="laser"), 422, "invalid")["fields"]) == ["format"]
    empty = analyst.post(API + "uploads", {"format": ""})
    assert "file" in error_of(empty, 422, "invalid")["fields"]
    error_of(send(analyst, "uploads", file="x"), 415, "unsupported_media_type")
    settings.UPLOAD_MB = 1
    error_of(upload(analyst, b" " * 1_000_001), 413, "too_large")
    assert not SceneUpload.objects.exists()


# --- Scenarios ---------------------------------------------------------------------------------


def test_a_scenario_gets_a_reference_that_is_checked_first(
    analyst: Client, sent: list[tuple[str, int]]
) -> None:
    add_scenario("street", reference=None)
    given = {"scene": "street-scene", "type": "cut_in", "instruction": "Place a car ahead."}
    error_of(send(analyst, "scenarios", **given, goal="back"), 422, "invalid")
    made = send(analyst, "scenarios", **given, slug="mine", density="low", goal="left").json()
    assert (made["slug"], made["type"], made["reference"]) == ("mine", "cut_in", None)
    assert (made["keep_traffic"], made["density"], made["goal"]) == (False, "low", "left")
    here = f"scenarios/{made['code']}"
    checked = send(analyst, here + "/check", modification=AWAY).json()
    assert checked["lines"][0]["severity"] == "wrong"
    assert checked["lines"][0]["sentence"].endswith(".")
    assert Scenario.objects.get(slug="mine").reference is None
    changed = send(analyst, here + "/reference", reference=CAR).json()
    assert changed["reference"]["add"][0]["id"] == "Added1"
    refused = send(analyst, here + "/reference", reference={"add": "a car"})
    error_of(refused, 400, "refused")
    assert send(analyst, here + "/reference", reference=None).json()["reference"] is None
    error_of(send(analyst, here + "/reference", reference=None), 409, "conflict")
    error_of(send(analyst, here + "/intent", intent={"version": "x"}), 400, "refused")
    mine = Scenario.objects.get(slug="mine").pk
    assert sent == [("enqueue_scenario", mine)] * 3


def test_many_scenarios_are_added_all_or_none(analyst: Client) -> None:
    add_scenario("street", reference=None)
    good = (
        "scene,type,instruction,slug,reference\nstreet-scene,cut_in,Place a car.,one,change.json\n"
    )
    wrong = good + "nowhere,cut_in,Place a car.,two,\n"
    assert bulk(analyst, wrong)["is_kept"] is False
    assert bulk(analyst, good, only_try="true") == {
        "is_kept": False,
        "rows": [{"number": 1, "slug": "", "problems": []}],
    }
    assert Scenario.objects.count() == 1
    assert bulk(analyst, good)["is_kept"] is True
    assert Scenario.objects.get(slug="one").reference is not None
    (row,) = [row for row in bulk(analyst, wrong)["rows"] if row["number"] == 2]
    assert "nowhere" in row["problems"][0][1]


def bulk(client: Client, text: str, **fields: object) -> Any:
    files = {
        "file": SimpleUploadedFile("many.csv", text.encode()),
        "documents": SimpleUploadedFile("change.json", json.dumps(CAR).encode()),
    }
    answer = client.post(API + "scenarios/bulk", {**files, **fields})
    assert answer.status_code == 200, answer.content
    return answer.json()


def test_a_model_reads_an_instruction_for_an_admin_alone(
    admin: Client, sent: list[tuple[str, int]]
) -> None:
    editing.add_endpoint(
        label="here", facts=editing.EndpointFacts(base_url="http://127.0.0.1:9/v1")
    )
    row = add_scenario("street")
    here = f"scenarios/{row.code}/reading"
    error_of(admin.get(API + here), 404, "not_found")
    answer = send(admin, here, endpoint="here", model="m")
    assert (answer.status_code, answer.json()["state"]) == (202, "running")
    assert sent == [("enqueue_reading", IntentReading.objects.get().pk)]
    error_of(send(admin, here + "/accept"), 409, "conflict")
    assert admin.get(API + here).json()["model"] == "m"


# --- Endpoints and models ----------------------------------------------------------------------


def test_an_endpoint_with_a_priced_model_is_probed(
    admin: Client, sent: list[tuple[str, int]]
) -> None:
    given = {"label": "here", "base_url": "http://127.0.0.1:9/v1", "max_concurrency": 3}
    made = send(admin, "endpoints", **given, requests_per_minute=60).json()
    assert (made["max_concurrency"], made["requests_per_minute"]) == (3, 60)
    error_of(send(admin, "endpoints", **given), 409, "conflict")
    here = f"endpoints/{made['code']}"
    changed = send(admin, here, base_url="http://127.0.0.1:8/v1", max_concurrency=2).json()
    assert (changed["base_url"], changed["max_concurrency"]) == ("http://127.0.0.1:8/v1", 2)
    model = send(admin, here + "/models", model="m").json()
    assert (model["endpoint"], model["price_in_usd"]) == ("here", None)
    there = f"models/{model['code']}"
    half = error_of(send(admin, there, price_in_usd="1.5"), 400, "refused")
    assert "price" in half["message"]
    price = {"price_in_usd": "1.5", "price_out_usd": "6", "price_as_of": "2026-01-31"}
    known = send(admin, there, **price, price_source="the list", vision=True).json()
    assert (known["price_out_usd"], known["vision"]) == ("6.000000", True)
    assert EndpointModel.objects.get().price_in_usd == Decimal("1.5")
    assert [one["model"] for one in admin.get(API + here).json()["models"]] == ["m"]
    error_of(admin.get(f"{API}{there}/probe"), 404, "not_found")
    answer = send(admin, there + "/probe")
    assert (answer.status_code, len(answer.json()["lines"])) == (202, 6)
    assert {line["progress"] for line in answer.json()["lines"]} == {"waiting"}
    assert sent == [("enqueue_probe", Probe.objects.get().pk)]
    error_of(send(admin, there + "/probe"), 409, "conflict")
    assert admin.get(f"{API}{there}/probe").json()["state"] == "queued"


def test_a_key_goes_to_another_server_only_where_somebody_says_so(admin: Client) -> None:
    given = {"base_url": "https://one.example/v1", "key_variable": "ONE_API_KEY"}
    made = send(admin, "endpoints", label="one", **given).json()
    moved = given | {"base_url": "https://two.example/v1"}
    error_of(send(admin, f"endpoints/{made['code']}", **moved), 409, "conflict")
    assert Endpoint.objects.get().base_url == given["base_url"]
    answer = send(admin, f"endpoints/{made['code']}", **moved, move_key=True)
    assert answer.json()["base_url"] == moved["base_url"]


def test_an_analyst_reads_endpoints_and_changes_none() -> None:
    accounts = people()
    admin, analyst = (program_of(accounts[role]) for role in ("admin", "analyst"))
    site = send(admin, "endpoints", label="one", base_url="https://one.example/v1").json()
    model = send(admin, f"endpoints/{site['code']}/models", model="m").json()
    for path in (f"endpoints/{site['code']}", f"models/{model['code']}"):
        assert analyst.get(API + path).status_code == 200
        error_of(send(analyst, path), 403, "forbidden")
    for path in (f"endpoints/{site['code']}/models", f"models/{model['code']}/probe"):
        error_of(send(analyst, path), 403, "forbidden")


# --- Corrections -------------------------------------------------------------------------------


def test_a_correction_is_an_augmentation_of_a_person(
    analyst: Client, sent: list[tuple[str, int]]
) -> None:
    row = launch().augmentations.get()
    runner.work_on(augmentation_pk=row.pk)
    path = f"augmentations/{row.code}/corrections"
    error_of(send(analyst, path, modification={}), 400, "refused")
    error_of(send(analyst, path, modification=CAR, contestant="No Slug"), 400, "refused")
    answer = send(analyst, path, modification=CAR, notes="too far left")
    assert answer.status_code == 201, answer.content
    made = Augmentation.objects.get(corrects=row)
    assert answer.json()["code"] == str(made.code)
    assert (made.contestant.kind, made.notes) == (Contestant.Kind.HUMAN, "too far left")
    assert sent == [("enqueue_job", made.job_id)]
