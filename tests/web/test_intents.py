"""What a scenario asks for, on its page: shown, accepted and replaced by staff."""

import json
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest
from django.core.files.uploadedfile import SimpleUploadedFile
from django.test import Client

from augment.models import EndpointModel, IntentReading, Scenario
from augment.scene.codec import intent_to_document
from augment.scene.intent import Shape
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from tests.intents import cones
from tests.jobs.rows import add_scenario
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
RING = intent_to_document(cones(25.0, 8, Shape.RING))


@pytest.fixture
def staff() -> Client:
    return signed_in(people()["admin"])


def page(client: Client, scenario: Scenario) -> str:
    return client.get(f"/scenarios/{scenario.code}/").content.decode()


def send(client: Client, scenario: Scenario, **fields: object) -> str:
    answer = client.post(f"/scenarios/{scenario.code}/intent/", fields, follow=True)
    scenario.refresh_from_db()
    return answer.content.decode()


def file(text: str) -> SimpleUploadedFile:
    return SimpleUploadedFile("intent.json", text.encode())


def test_the_page_shows_what_the_instruction_asks_for(staff: Client) -> None:
    shown = page(staff, add_scenario("street"))
    assert "cones: 20 m ahead of the ego" in shown
    assert "entered" in shown
    none = page(staff, add_scenario("bare", intent=None, intent_origin=""))
    assert "Nobody has written down what the sentence asks for" in none


def test_what_a_model_read_is_shown_and_counts_once_accepted(staff: Client) -> None:
    scenario = add_scenario("street", intent=None, intent_origin="")
    endpoint = ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    IntentReading.objects.create(
        scenario=scenario, endpoint=endpoint, model="m", state="read", document=RING
    )
    shown = page(staff, scenario)
    assert "m at here read this. It does not count until you accept it" in shown
    assert "cones: in a ring" in shown
    assert "It counts from now on" in send(staff, scenario, accept="1")
    assert (scenario.intent, scenario.intent_origin) == (RING, "read")


def test_a_file_replaces_the_intent_and_can_be_fetched_again(staff: Client) -> None:
    scenario = add_scenario("street")
    send(staff, scenario, file=file(json.dumps(RING)))
    assert (scenario.intent, scenario.intent_origin) == (RING, "entered")
    assert staff.get(f"/scenarios/{scenario.code}/intent.json").json() == RING


def test_an_admin_has_an_instruction_read_by_a_worker(
    staff: Client,
    monkeypatch: pytest.MonkeyPatch,
    django_capture_on_commit_callbacks: Callable[..., AbstractContextManager[object]],
) -> None:
    scenario = add_scenario("street", intent=None, intent_origin="")
    endpoint = ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    reader = EndpointModel.objects.create(endpoint=endpoint, model="m")
    sent: list[int] = []
    monkeypatch.setattr("arena.scenarios.pages.scenarios.enqueue_reading", sent.append)
    assert "m at here" in page(staff, scenario)
    with django_capture_on_commit_callbacks(execute=True):
        staff.post(f"/scenarios/{scenario.code}/read/", {"reader": str(reader.code)})
    row = IntentReading.objects.get()
    assert (sent, row.state, row.model) == ([row.pk], "running", "m")
    Scenario.objects.update(original_image="drawn.png", reference=None)
    shown = page(staff, scenario)
    assert all(word in shown for word in ("m at here reads it now", "data-live"))
    IntentReading.objects.update(state=IntentReading.State.FAILED)
    assert "data-live" not in page(staff, scenario)


def test_a_note_of_the_scene_stands_on_the_page_as_a_sentence() -> None:
    earlier = {"kind": "objects_left_out", "number": 2, "names": ["<b>vegetation</b>"]}
    scenario = add_scenario("street")
    scenario.base_scene.notes = ["No lights.", earlier]
    scenario.base_scene.save()
    answer = signed_in(people()["admin"]).get(f"/scenarios/{scenario.code}/")
    page = answer.content.decode().partition("<dt>Left open by the source</dt>")[2]
    assert "<li>No lights.</li>" in page
    assert "Objects left out: 2, &lt;b&gt;vegetation" in page, "what a file says is text"
