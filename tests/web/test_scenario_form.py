"""New scenarios by a page: one beside its scene, or many from a file."""

import json
import re

import pytest
from django.core.files.uploadedfile import SimpleUploadedFile
from django.test import Client
from django.urls import reverse

from arena.scenarios.queries import by_type
from augment.models import BaseScene, GenerationJob, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.scenarios.pictures import draw_scenario, draw_scene
from tests.jobs.rows import add_scenario
from tests.scenes import cone
from tests.study_rows import a_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
CHANGE = json.dumps(modification_to_document(Modification(added=(cone("Added1", 9.0, 0.0),))))
ROWS = f"""scene,type,instruction,slug,reference
street-scene,cut_in,Let a car cut in.,one,
street-scene,jaywalking_pedestrian,Let somebody cross.,two,"{CHANGE.replace(chr(34), chr(34) * 2)}"
"""


@pytest.fixture
def reader(monkeypatch: pytest.MonkeyPatch) -> Client:
    """Signed in; what is sent to a worker is done at once."""
    monkeypatch.setattr("arena.scenarios.pages.editor.enqueue_scene", draw_scene)
    monkeypatch.setattr("arena.scenarios.pages.editor.enqueue_scenario", draw_scenario)
    monkeypatch.setattr("arena.shell.acts.transaction.on_commit", lambda done: done())
    return signed_in(people()["researcher"])


@pytest.fixture
def scene() -> BaseScene:
    return add_scenario("street").base_scene


def send(client: Client, scene: BaseScene, **fields: str) -> tuple[str, Scenario | None]:
    given = {"type": "cut_in", "instruction": "Let a car cut in.", **fields}
    answer = client.post(reverse("scene", args=[scene.code]), given, follow=True)
    made = Scenario.objects.exclude(slug="street").first()
    return answer.content.decode(), made


def test_a_drawing_alone_becomes_a_scenario_with_sentence_and_intent(
    reader: Client, scene: BaseScene
) -> None:
    draw_scene(scene.pk)
    shown = reader.get(reverse("scene", args=[scene.code])).content.decode()
    assert 'name="keep_traffic" checked' in re.sub(r"\s+", " ", shown)
    shown, made = send(
        reader,
        scene,
        type="",
        own_type="parked_bus",
        slug="my-bus",
        instruction="",
        modification=CHANGE,
        derives="on",
        keep_traffic="on",
    )
    assert made is not None
    assert (made.slug, made.type, made.type_label) == ("my-bus", "parked_bus", "Parked bus")
    assert (made.keep_traffic, made.intent_origin) == (True, "derived")
    assert made.instruction.startswith("Change the scene: a traffic cone 9.0 m ahead of the ego")
    assert made.intent is not None
    [request] = made.intent["requests"]
    assert (request["kind"], request["spot"]["distance"]) == ("vehicles", {"low_m": 9.0})
    copied = reader.get(reverse("scene", args=[scene.code]) + f"?copy={made.code}")
    assert "&quot;TRAFFIC_CONE&quot;" in copied.content.decode()
    assert "my-bus" in shown
    assert reverse("picture", args=["original", made.code]) in shown


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"type": "", "own_type": "插队"}, "must be one of"),
        ({"modification": "[" * 100_000}, "is no JSON"),
        ({"modification": '{"add": 3}', "type": "cut_in"}, "add"),
        ({"modification": CHANGE.replace("9.0", "1e9"), "type": "cut_in"}, "x_m"),
        ({"type": "jaywalking_pedestrian", "instruction": " "}, "Type a sentence"),
    ],
)
def test_what_can_not_be_is_told_and_nothing_is_lost(
    reader: Client, scene: BaseScene, fields: dict[str, str], problem: str
) -> None:
    shown, made = send(reader, scene, **{"slug": "kept-as-it-was", **fields})
    assert made is None
    assert problem in shown
    assert fields.get("slug", "kept-as-it-was") in shown


def test_names_become_slugs(reader: Client, scene: BaseScene) -> None:
    _, made = send(reader, scene, slug="Street", type="", own_type="Cut In")
    assert made is not None
    assert (made.slug, made.type) == ("street-2", "cut_in")


def upload(client: Client, text: str) -> str:
    given = {"file": SimpleUploadedFile("many.csv", text.encode())}
    return client.post(reverse("scenarios-bulk"), given, follow=True).content.decode()


@pytest.mark.usefixtures("scene")
def test_a_file_is_added_as_a_whole_or_not_at_all(reader: Client) -> None:
    assert "Nothing was added" in upload(reader, ROWS.replace("two", "One"))
    assert Scenario.objects.count() == 1
    assert "2 scenarios are added" in upload(reader, ROWS)
    assert Scenario.objects.get(slug="two").reference is not None


def test_what_nothing_needs_is_deleted_and_else_is_said_what_needs_it(scene: BaseScene) -> None:
    study = a_study(scenarios=1, votes_per_expert=1)
    place = study.scenarios.get()
    admin = signed_in(people()["admin"])
    needed = admin.post(reverse("scenario-delete", args=[place.code]), {"sure": "1"}, follow=True)
    assert "needed by the study “Round 1”" in needed.content.decode()
    base = reverse("scene-delete", args=[place.base_scene.code])
    assert (
        "the scenario “place-0”" in admin.post(base, {"sure": "1"}, follow=True).content.decode()
    )
    for made in scene.scenarios.all():
        admin.post(reverse("scenario-delete", args=[made.code]), {"sure": "1"})
    admin.post(reverse("scene-delete", args=[scene.code]), {"sure": "1"})
    assert not BaseScene.objects.filter(pk=scene.pk).exists()
    assert list(Scenario.objects.all()) == [place]


def test_a_scenario_is_changed_until_something_needs_it(reader: Client, scene: BaseScene) -> None:
    _, made = send(reader, scene, type="jaywalking_pedestrian")
    assert made is not None
    page = reverse("scenario-edit", args=[made.code])
    shown = reader.get(page).content.decode()
    assert "Let a car cut in.</textarea>" in shown
    given = {"type": "jaywalking_pedestrian", "instruction": "Let a bus cut in.", "density": "low"}
    assert "is changed" in reader.post(page, given, follow=True).content.decode()
    made.refresh_from_db()
    assert (made.instruction, made.traffic_density) == ("Let a bus cut in.", "low")
    assert made.spawned is not None
    job = GenerationJob.objects.create(name="Round 1")
    job.scenarios.add(made)
    refused = reader.post(page, given | {"instruction": "Let a tram cut in."}).content.decode()
    assert "can’t be changed; it is needed by the job “Round 1”" in refused
    assert "Let a tram cut in." in refused
    made.refresh_from_db()
    assert made.instruction == "Let a bus cut in."


def test_what_is_retired_is_offered_no_more(scene: BaseScene) -> None:
    admin = signed_in(people()["admin"])
    made = scene.scenarios.get()
    admin.post(reverse("scenario-retired", args=[made.code]), {"retired": "yes"})
    assert resolve_scenarios(["all"]) == []
    assert resolve_scenarios([made.slug]) == [made.slug]
    assert by_type() == []
    listed = admin.get(reverse("scenarios")).content.decode()
    assert reverse("scenario", args=[made.code]) not in listed
    retired = admin.get(reverse("scenarios") + "?offered=retired").content.decode()
    assert reverse("scenario", args=[made.code]) in retired
    admin.post(reverse("scenario-retired", args=[made.code]), {"retired": "no"})
    assert resolve_scenarios(["all"]) == [made.slug]
