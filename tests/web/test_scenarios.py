"""Scenes and scenarios by pages: sent, drawn, written, changed, asked for and deleted."""

import json
import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from tempfile import gettempdir

import pytest
from django.conf import LazySettings
from django.core.files.uploadedfile import SimpleUploadedFile
from django.db.models import Model
from django.test import Client
from django.urls import reverse

from arena.scenarios.queries import by_type
from augment.models import (
    Augmentation,
    BaseScene,
    EndpointModel,
    GenerationJob,
    IntentReading,
    Scenario,
    SceneUpload,
    UploadMoment,
)
from augment.scene.codec import intent_to_document, modification_to_document, scene_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Shape
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.running import runner
from augment.services.scenarios import uploads
from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.scenarios.pictures import draw_scenario, draw_scene
from tests import scenes
from tests.formats.openscenario_files import ROADS
from tests.intents import cones
from tests.jobs.rows import add_scenario, launch
from tests.scenes import cone, vehicle
from tests.study_rows import a_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


STREET = json.dumps(
    scene_to_document(scenes.scene(agents=(vehicle("Agent2", 20.0, 0.0),)))
).encode()


@pytest.fixture(autouse=True)
def working(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is sent to a worker is done at once."""
    work: dict[type[Model], Callable[[int], object]] = {
        SceneUpload: uploads.UPLOADS.perform,
        UploadMoment: uploads.MOMENTS.perform,
        BaseScene: draw_scene,
        Scenario: draw_scenario,
        Augmentation: runner.AUGMENTATIONS.perform,
    }
    monkeypatch.setattr("arena.shell.sending.enqueue_row", lambda row: work[type(row)](row.pk))
    monkeypatch.setattr("arena.shell.sending.transaction.on_commit", lambda done: done())


def send_file(client: Client, content: bytes = STREET, name: str = "street.json") -> str:
    file = SimpleUploadedFile(name, content)
    answer = client.post(reverse("scene-send"), {"file": file, "format": ""}, follow=True)
    return answer.content.decode()


def is_picture(client: Client, address: str) -> bool:
    answer = client.get(address)
    return b"".join(answer).startswith(b"\x89PNG")


def test_from_a_file_to_a_scene(researcher: Client) -> None:
    shown = send_file(researcher)
    moment = UploadMoment.objects.get()
    picture = reverse("picture", args=["moment", moment.code])
    assert picture in shown
    assert is_picture(researcher, picture)
    again = reverse("upload-show", args=[moment.upload.code])
    assert picture in researcher.post(again, {"stop": "0"}, follow=True).content.decode()
    assert "no such moment" in researcher.post(again, {"stop": "1"}, follow=True).content.decode()
    answer = researcher.post(
        again, {"stop": "0", "keep": "1", "name": "Hauptstraße Süd"}, follow=True
    )
    scene_row = BaseScene.objects.get()
    page = reverse("scene", args=[scene_row.code])
    assert (scene_row.slug, answer.redirect_chain[-1][0]) == ("hauptstrae-sud", page)
    for view in ("kept", "backdrop"):
        assert is_picture(researcher, reverse("picture", args=[view, scene_row.code]))
    assert "picture" in researcher.get(page).content.decode()


def test_the_ego_of_a_map_is_put_where_somebody_clicks(
    researcher: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = send_file(researcher, ROADS.encode(), "roads.xodr")
    upload = SceneUpload.objects.get()
    (moment,) = upload.moments.exclude(report=None)
    assert moment.report is not None
    # 240 by 180 m of the road in 1200 by 900 pixels; the ego stands at s = 200, in lane 1.
    assert ('id="places"' in shown, moment.item) == (True, "@1,1,200")
    form = shown.partition('name="place"')[0].rpartition("<form")[2]
    assert "keep" not in form, "what Enter in that field would press first"
    rows = moment.report["places"]["1,-1"]
    assert [rows[0], rows[-1]] == [[80.0, 1200.0, 432.0], [320.0, 0.0, 432.0]]

    def put(place: str) -> str:
        page = reverse("upload-show", args=[upload.code])
        answer = researcher.post(page, {"put": "1", "place": place}, follow=True)
        return answer.content.decode()

    assert "put on lane -2 of road 1, at s = 300 m" in put("1,-2,300")
    placed = UploadMoment.objects.get(item="@1,-2,300")
    assert (placed.state, placed.report and placed.report["lanes"]) == ("drawn", 3)
    assert 'value="1,-2,300"' in put(" 1,-2,300.0 "), "the same place once more"
    assert UploadMoment.objects.filter(item="@1,-2,300").count() == 1
    assert "unknown &#x27;9&#x27;; known: 1" in put("9,-1,5"), "a worker says so"
    for place in ("here", "1,-1", "1,-1,nan"):
        assert "no place; needs ROAD,LANE,S" in put(place) or "place: " in put(place)
    assert "characters that print" in put("1\0,-1,5")
    assert "too long" in put(f"{'1' * 200},-1,5")
    monkeypatch.setattr(uploads, "MOST_PLACES", upload.moments.count())
    assert "places of this map are drawn already" in put("1,-2,301")
    assert 'value="1,-2,300"' in put("1,-2,300"), "one of them"
    send_file(researcher)
    upload = SceneUpload.objects.get(name="street.json")
    assert "no map alone" in put("1,-2,300")


def test_of_several_files_what_can_not_be_read_says_why(researcher: Client) -> None:
    files = [SimpleUploadedFile("one.json", STREET), SimpleUploadedFile("two.txt", b"hello")]
    researcher.post(reverse("scene-send"), {"file": files})
    states = SceneUpload.objects.order_by("name").values_list("name", "state")
    assert list(states) == [("one.json", "read"), ("two.txt", "failed")]
    failed = SceneUpload.objects.get(name="two.txt")
    shown = researcher.get(reverse("upload", args=[failed.code])).content.decode()
    assert "Nothing was kept." in shown
    assert gettempdir() not in shown
    assert "none of the formats" in shown


def test_a_file_that_is_too_large_is_not_kept(researcher: Client, settings: LazySettings) -> None:
    settings.UPLOAD_MB = 1
    shown = send_file(researcher, b" " * 1_000_001)
    assert "files of at most 1 MB" in shown
    assert not SceneUpload.objects.exists()
    cut = {"file": SimpleUploadedFile("cut.json", STREET)}
    page = researcher.post(reverse("scene-send"), cut, headers={"X-Body-Cut": "1"}, follow=True)
    assert "files of at most 1 MB" in page.content.decode(), "the web server dropped the rest"
    assert not SceneUpload.objects.exists()
    assert "Use this moment" in send_file(researcher, STREET + b" " * (1_000_000 - len(STREET)))


def test_a_page_that_looks_again_asks_for_no_picture_anew(
    researcher: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    row, asked = add_scenario("street", scene=scenes.scene()).base_scene, list[BaseScene]()
    monkeypatch.setattr("arena.shell.sending.enqueue_row", asked.append)
    page = reverse("scenes")
    researcher.get(page, headers={"X-Looks-Again": "1"})
    assert asked == []
    researcher.get(page)
    assert asked == [row]


CHANGE = json.dumps(modification_to_document(Modification(added=(cone("Added1", 9.0, 0.0),))))
ROWS = f"""scene,type,instruction,slug,reference
street-scene,cut_in,Let a car cut in.,one,
street-scene,jaywalking_pedestrian,Let somebody cross.,two,"{CHANGE.replace(chr(34), chr(34) * 2)}"
"""


@pytest.fixture
def scene() -> BaseScene:
    return add_scenario("street").base_scene


def add(client: Client, scene: BaseScene, **fields: str) -> tuple[str, Scenario | None]:
    given = {"type": "cut_in", "instruction": "Let a car cut in.", **fields}
    answer = client.post(reverse("scene", args=[scene.code]), given, follow=True)
    made = Scenario.objects.exclude(slug="street").first()
    return answer.content.decode(), made


def test_a_drawing_alone_becomes_a_scenario_with_sentence_and_intent(
    researcher: Client, scene: BaseScene
) -> None:
    draw_scene(scene.pk)
    shown = researcher.get(reverse("scene", args=[scene.code])).content.decode()
    assert 'name="keep_traffic" checked' in re.sub(r"\s+", " ", shown)
    shown, made = add(
        researcher,
        scene,
        type="",
        own_type="Parked Bus",
        slug="My bus",
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
    copied = researcher.get(reverse("scene", args=[scene.code]) + f"?copy={made.code}")
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
    researcher: Client, scene: BaseScene, fields: dict[str, str], problem: str
) -> None:
    shown, made = add(researcher, scene, **{"slug": "kept-as-it-was", **fields})
    assert made is None
    assert problem in shown
    assert fields.get("slug", "kept-as-it-was") in shown


def send_rows(client: Client, text: str) -> str:
    given = {"file": SimpleUploadedFile("many.csv", text.encode())}
    return client.post(reverse("scenarios-bulk"), given, follow=True).content.decode()


@pytest.mark.usefixtures("scene")
def test_a_file_is_added_as_a_whole_or_not_at_all(researcher: Client) -> None:
    assert "Nothing was added" in send_rows(researcher, ROWS.replace("two", "One"))
    assert Scenario.objects.count() == 1
    assert "2 scenarios are added" in send_rows(researcher, ROWS)
    assert Scenario.objects.get(slug="two").reference is not None


def test_what_nothing_needs_is_deleted_and_else_is_said_what_needs_it(
    scene: BaseScene, admin: Client
) -> None:
    study = a_study(scenarios=1, votes_per_expert=1)
    place = study.scenarios.get()
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


def test_a_scenario_is_changed_until_something_needs_it(
    researcher: Client, scene: BaseScene
) -> None:
    _, made = add(researcher, scene, type="jaywalking_pedestrian")
    assert made is not None
    page = reverse("scenario-edit", args=[made.code])
    shown = researcher.get(page).content.decode()
    assert "Let a car cut in.</textarea>" in shown
    given = {"type": "jaywalking_pedestrian", "instruction": "Let a bus cut in.", "density": "low"}
    assert "is changed" in researcher.post(page, given, follow=True).content.decode()
    made.refresh_from_db()
    assert (made.instruction, made.traffic_density) == ("Let a bus cut in.", "low")
    assert made.spawned is not None
    job = GenerationJob.objects.create(name="Round 1")
    job.scenarios.add(made)
    refused = researcher.post(page, given | {"instruction": "Let a tram cut in."}).content.decode()
    assert "can’t be changed; it is needed by the job “Round 1”" in refused
    assert "Let a tram cut in." in refused
    made.refresh_from_db()
    assert made.instruction == "Let a bus cut in."


def test_what_is_retired_is_offered_no_more(scene: BaseScene, admin: Client) -> None:
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


CAR = json.dumps(modification_to_document(Modification(added=(vehicle("Added1", 20.0, 0.4),))))


def test_a_drawn_reference_is_kept_and_shown(researcher: Client) -> None:
    traffic = (vehicle("Agent2", 40.0, 3.5, 3.14),)
    here = add_scenario(
        "street", scene=scenes.scene(agents=traffic), reference=None, keep_traffic=True
    )
    given = {"type": here.type, "instruction": here.instruction, "keep_traffic": "on"}
    given |= {"modification": CAR, "derives": "on", "density": "none"}
    url = reverse("scenario-edit", args=[here.code])
    shown = researcher.post(url, given, follow=True).content.decode()
    assert reverse("picture", args=["reference", here.code]) in shown
    here.refresh_from_db()
    assert here.intent_origin == "derived"
    asked = {"modification": json.loads(CAR), "derives": True, "keep_traffic": True}
    check = reverse("edit-check", args=[here.base_scene.code])
    found = researcher.post(check, asked, content_type="application/json").json()
    assert "20.0 m ahead of the ego" in found["sentence"]
    assert "vehicle: in the own lane" in found["statements"]


def test_an_augmentation_is_corrected_and_both_say_so(researcher: Client) -> None:
    row = launch().augmentations.get()
    runner.AUGMENTATIONS.perform(row.pk)
    draw_scene(row.scenario.base_scene_id)
    url = reverse("correct", args=[row.code])
    page = reverse("augmentation", args=[row.code])
    assert url in researcher.get(page).content.decode()
    assert "&quot;add&quot;" in researcher.get(url).content.decode()
    refused = researcher.post(url, {"modification": CAR, "contestant": row.contestant.slug})
    assert refused.status_code == 422
    shown = researcher.post(
        url, {"modification": CAR, "contestant": "Zoë 王", "notes": "too far left"}, follow=True
    ).content.decode()
    made = Augmentation.objects.get(corrects=row)
    assert (made.state, made.contestant.kind, made.notes) == ("done", "human", "too far left")
    assert (made.contestant.slug, made.contestant.name) == ("zoe", "Zoë 王")
    assert "Corrected by hand by the-researcher" in shown
    assert page in shown
    picture = researcher.get(reverse("picture", args=["augmentation", made.code]))
    assert b"".join(picture).startswith(b"\x89PNG")
    assert reverse("augmentation", args=[made.code]) in researcher.get(page).content.decode()


RING = intent_to_document(cones(25.0, 8, Shape.RING))


def page_of(client: Client, scenario: Scenario) -> str:
    return client.get(f"/scenarios/{scenario.code}/").content.decode()


def send_intent(client: Client, scenario: Scenario, **fields: object) -> str:
    answer = client.post(f"/scenarios/{scenario.code}/intent/", fields, follow=True)
    scenario.refresh_from_db()
    return answer.content.decode()


def file(text: str) -> SimpleUploadedFile:
    return SimpleUploadedFile("intent.json", text.encode())


def test_the_page_shows_what_the_instruction_asks_for(admin: Client) -> None:
    shown = page_of(admin, add_scenario("street"))
    assert "cones: 20 m ahead of the ego" in shown
    assert "entered" in shown
    none = page_of(admin, add_scenario("bare", intent=None, intent_origin=""))
    assert "Nobody has written down what the sentence asks for" in none


def test_what_a_model_read_is_shown_and_counts_once_accepted(admin: Client) -> None:
    scenario = add_scenario("street", intent=None, intent_origin="")
    endpoint = ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    IntentReading.objects.create(
        scenario=scenario, endpoint=endpoint, model="m", state="read", document=RING
    )
    shown = page_of(admin, scenario)
    assert "m at here read this. It does not count until you accept it" in shown
    assert "cones: in a ring" in shown
    assert "It counts from now on" in send_intent(admin, scenario, accept="1")
    assert (scenario.intent, scenario.intent_origin) == (RING, "read")


def test_a_file_replaces_the_intent_and_can_be_fetched_again(admin: Client) -> None:
    scenario = add_scenario("street")
    send_intent(admin, scenario, file=file(json.dumps(RING)))
    assert (scenario.intent, scenario.intent_origin) == (RING, "entered")
    assert admin.get(f"/scenarios/{scenario.code}/intent.json").json() == RING


def test_an_admin_has_an_instruction_read_by_a_worker(
    admin: Client,
    monkeypatch: pytest.MonkeyPatch,
    django_capture_on_commit_callbacks: Callable[..., AbstractContextManager[object]],
) -> None:
    scenario = add_scenario("street", intent=None, intent_origin="")
    endpoint = ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    reader = EndpointModel.objects.create(endpoint=endpoint, model="m")
    sent: list[IntentReading] = []
    assert "m at here" in page_of(admin, scenario)
    monkeypatch.setattr("arena.shell.sending.enqueue_row", sent.append)
    with django_capture_on_commit_callbacks(execute=True):
        admin.post(f"/scenarios/{scenario.code}/read/", {"reader": str(reader.code)})
    row = IntentReading.objects.get()
    assert (sent, row.state, row.model) == ([row], "running", "m")
    Scenario.objects.update(original_image="drawn.png", reference=None)
    shown = page_of(admin, scenario)
    assert all(word in shown for word in ("m at here reads it now", "data-live"))
    IntentReading.objects.update(state=IntentReading.State.FAILED)
    assert "data-live" not in page_of(admin, scenario)


def test_a_note_of_the_scene_stands_on_the_page_as_a_sentence() -> None:
    earlier = {"kind": "objects_left_out", "number": 2, "names": ["<b>vegetation</b>"]}
    scenario = add_scenario("street")
    scenario.base_scene.notes = ["No lights.", earlier]
    scenario.base_scene.save()
    answer = signed_in(people()["admin"]).get(f"/scenarios/{scenario.code}/")
    page_of = answer.content.decode().partition("<dt>Left open by the source</dt>")[2]
    assert "<li>No lights.</li>" in page_of
    assert "Objects left out: 2, &lt;b&gt;vegetation" in page_of, "what a file says is text"
