"""Scenes, scenarios, endpoints and models are made by the wire as on the pages."""

import json
from collections.abc import Callable
from typing import Any

import pytest
from django.conf import LazySettings
from django.core.files.uploadedfile import SimpleUploadedFile
from django.test import Client

from augment.models import BaseScene, Probe, Scenario, SceneUpload
from augment.scene.codec import modification_to_document, scene_to_document
from augment.scene.entities import Modification
from augment.services.endpoints.probing import ABILITIES
from augment.services.scenarios import uploads
from tests.api.asking import error_of
from tests.api.tokens import program_of
from tests.jobs.rows import add_scenario
from tests.scenes import scene, vehicle
from tests.web.cast import people

pytestmark = pytest.mark.django_db

API = "/api/v1/"
STREET = json.dumps(scene_to_document(scene(agents=(vehicle("Agent2", 20.0, 0.0),)))).encode()
CAR = modification_to_document(Modification(added=(vehicle("Added1", 20.0, 0.4),)))


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Messages to the workers, as task and key; nobody takes them but the test."""
    found: list[tuple[str, int]] = []
    for place, name in (
        ("scenarios", "enqueue_upload"),
        ("scenarios", "enqueue_moment"),
        ("scenarios", "enqueue_scenario"),
        ("contestants", "enqueue_probe"),
    ):
        monkeypatch.setattr(f"arena.{place}.api.{name}", _noting(found, name))
    monkeypatch.setattr("arena.api.views.transaction.on_commit", lambda done: done())
    return found


def _noting(found: list[tuple[str, int]], name: str) -> Callable[[int], None]:
    return lambda pk: found.append((name, pk))


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
    assert sent == [("enqueue_upload", SceneUpload.objects.get().pk)]
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
    assert sent == [("enqueue_scenario", row.pk)]


# --- Endpoints and models ----------------------------------------------------------------------


def test_a_model_of_a_new_endpoint_is_probed(admin: Client, sent: list[tuple[str, int]]) -> None:
    given = {"label": "here", "base_url": "http://127.0.0.1:9/v1", "max_concurrency": 3}
    made = send(admin, "endpoints", **given, requests_per_minute=60).json()
    assert (made["max_concurrency"], made["requests_per_minute"]) == (3, 60)
    error_of(send(admin, "endpoints", **given), 409, "conflict")
    model = send(admin, f"endpoints/{made['code']}/models", model="m").json()
    assert (model["endpoint"], model["price_in_usd"]) == ("here", None)
    there = f"models/{model['code']}/probe"
    assert sent == [("enqueue_probe", Probe.objects.get().pk)]
    error_of(send(admin, there), 409, "conflict")
    Probe.objects.update(state=Probe.State.DONE)
    answer = send(admin, there)
    assert (answer.status_code, len(answer.json()["lines"])) == (202, len(ABILITIES))
    assert {line["progress"] for line in answer.json()["lines"]} == {"waiting"}
    assert admin.get(API + there).json()["state"] == "queued"
