import json
from io import StringIO
from pathlib import Path

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.models import BaseScene, Event, Scenario
from augment.scene.codec import intent_to_document, modification_to_document, scene_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Shape
from augment.services.scenarios.scene_imports import import_scene
from tests.intents import cones
from tests.scenes import cone, scene, vehicle

pytestmark = pytest.mark.django_db


@pytest.fixture(autouse=True)
def street(tmp_path: Path) -> BaseScene:
    file = tmp_path / "street.json"
    file.write_text(json.dumps(scene_to_document(scene(agents=(vehicle("Agent2", 20.0, 0.0),)))))
    return import_scene(source="json", path=file, frame=0, slug="street")


def run(**options: object) -> str:
    out = StringIO()
    asked = {
        "scene": "street",
        "type": "approaching_construction_zone",
        "instruction": "Add a cone 9 m ahead.",
    }
    call_command("add_scenario", stdout=out, **(asked | options))
    return out.getvalue()


def refused(**options: object) -> str:
    before = Scenario.objects.count(), Event.objects.count()
    with pytest.raises(CommandError) as caught:
        run(**options)
    assert caught.value.returncode == 1
    assert (Scenario.objects.count(), Event.objects.count()) == before
    return str(caught.value)


def reference(folder: Path, text: str) -> Path:
    file = folder / "reference.json"
    file.write_text(text)
    return file


CHANGE = json.dumps(modification_to_document(Modification(added=(cone("Agent2", 9.0, 0.0),))))


def test_a_scenario_is_added_with_a_reference_an_intent_or_neither(tmp_path: Path) -> None:
    assert run() == "Added scenario street-construction-zone-1 without a reference.\n"
    out = run(slug="cones", reference=reference(tmp_path, CHANGE))
    assert out == "Added scenario cones with a reference.\n"
    assert Scenario.objects.get(slug="cones").reference == json.loads(CHANGE)
    wanted = intent_to_document(cones(9.0, 1, Shape.LINE))
    out = run(slug="asked", intent=reference(tmp_path, json.dumps(wanted)))
    assert out == "Added scenario asked without a reference, with its intent.\n"
    row = Scenario.objects.get(slug="asked")
    assert (row.intent, row.intent_origin) == (wanted, "entered")


def test_a_reference_that_can_not_be_read_or_does_not_fit_is_refused(tmp_path: Path) -> None:
    file = reference(tmp_path, CHANGE)
    assert "Agent2 is in the scene already" in refused(reference=file, keep_traffic=True)
    file = reference(tmp_path, CHANGE.replace('"x_m": 9.0', '"x_m": Infinity'))
    assert "add[0].x_m" in refused(reference=file)
    assert "holds null" in refused(reference=reference(tmp_path, "null"))
    assert "No such file" in refused(reference=tmp_path / "gone.json")
