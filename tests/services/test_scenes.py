import json
from pathlib import Path

import pytest

from augment.errors import InvalidDocument, InvalidModification
from augment.models import BaseScene, IntentReading, Scenario
from augment.scene.codec import (
    intent_to_document,
    modification_to_document,
    recording_from_document,
    scene_to_document,
)
from augment.scene.entities import Modification
from augment.scene.intent import Shape
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.scenarios.editing import accept_reading, enter_intent
from augment.services.scenarios.scene_imports import import_scene
from augment.services.scenarios.scenes import LoadedScenario, NewScenario, add_scenario
from tests.formats.av2_logs import write_log
from tests.intents import cones
from tests.scenes import cone, scene, vehicle

pytestmark = pytest.mark.django_db

BUSY = scene(agents=(vehicle("Agent2", 20.0, 0.0),))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / "busy.json"
    file.write_text(json.dumps(scene_to_document(BUSY)))
    return file


@pytest.fixture
def street(file: Path) -> BaseScene:
    return import_scene(source="json", path=file, frame=0, slug="street")


def scenario(**changes: object) -> Scenario:
    asked = {"scene": "street", "type": "jaywalking_pedestrian", "instruction": "add a pedestrian"}
    return add_scenario(NewScenario(**(asked | changes)))  # type: ignore[arg-type]


def test_a_recorded_scene_comes_with_its_recording(tmp_path: Path) -> None:
    row = import_scene(source="av2", path=write_log(tmp_path / "log"), frame=1, slug="made")
    row.refresh_from_db()
    assert (row.source, row.document["name"]) == ("av2", "made")
    recording = recording_from_document(row.recording)
    assert len(recording.times_s) == 4
    assert "log log, step 1 of 5" in row.provenance


@pytest.mark.usefixtures("street")
def test_an_instruction_that_can_not_be_kept_is_refused() -> None:
    for instruction, problem in (
        (" \n", "is empty"),
        ("a" * 2_001, "2001 characters are too many, at most 2000"),
        ("a\0b", "signs that no database takes"),
        ("a\ud800b", "signs that no database takes"),
    ):
        with pytest.raises(InvalidDocument, match=problem):
            scenario(instruction=instruction)
        assert not Scenario.objects.exists()


def test_a_scene_with_a_text_that_no_database_takes_is_refused(file: Path) -> None:
    document = scene_to_document(BUSY) | {"provenance": "HERE"}
    for escaped in ("\\u0000", "\\ud800"):
        file.write_text(json.dumps(document).replace("HERE", escaped))
        with pytest.raises(InvalidDocument, match=r"busy\.json"):
            import_scene(source="json", path=file, frame=0, slug="street")
        assert not BaseScene.objects.exists()


@pytest.mark.usefixtures("street")
def test_a_reference_comes_back_as_it_went_in() -> None:
    change = Modification(added=(cone("Agent2", 9.0, 0.5),))
    row = scenario(reference=modification_to_document(change))
    row.refresh_from_db()
    assert LoadedScenario(row).reference == change
    assert LoadedScenario(scenario()).reference is None


@pytest.mark.usefixtures("street")
def test_a_reference_has_to_fit_the_scene() -> None:
    change = modification_to_document(Modification(added=(cone("Agent2", 9.0, 0.5),)))
    with pytest.raises(InvalidModification, match="Agent2 is in the scene already"):
        scenario(reference=change, keep_traffic=True)
    change["add"][0]["lane_id"] = "Lane9"
    with pytest.raises(InvalidDocument, match="'Lane9' is not a lane"):
        scenario(reference=change)
    assert not Scenario.objects.exists()


def test_no_door_takes_an_intent_that_jobs_would_refuse(street: BaseScene) -> None:
    whole = intent_to_document(cones(25.0, 8, Shape.RING))
    [request] = whole["requests"]
    left_open = whole | {"requests": [{**request, "shape": None}]}
    with pytest.raises(InvalidDocument, match="leaves open the shape"):
        scenario(intent=left_open)
    made = scenario(intent=whole)
    with pytest.raises(InvalidDocument, match="leaves open the shape"):
        enter_intent(scenario=made.slug, document=left_open)
    endpoint = ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    IntentReading.objects.create(
        scenario=made, endpoint=endpoint, model="m", state="read", document=left_open
    )
    with pytest.raises(InvalidDocument, match="leaves open the shape"):
        accept_reading(scenario=made.slug)
    assert IntentReading.objects.get().state == "read"
    made.refresh_from_db()
    assert made.intent == whole
