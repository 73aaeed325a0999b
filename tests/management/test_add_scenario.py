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


# --- Many from one file: all of them, or none and every error with its row --------------------

IN_CSV = CHANGE.replace('"', '""')
CSV = f"""scene,type,instruction,slug,keep_traffic,reference
street,cut_in,"Let a car cut in, closely.",one,yes,
street,jaywalking_pedestrian,Let somebody cross.,,,"{IN_CSV}"
"""
YAML = """
- {scene: street, type: cut_in, instruction: Let a car cut in.}
- {scene: street, type: cut_in, instruction: And another., keep_traffic: true}
- scene: street
  type: jaywalking_pedestrian
  instruction: Let somebody cross.
  reference:
""" + json.dumps(json.loads(CHANGE), indent=2).replace("\n", "\n    ").replace("{", "    {", 1)


def add(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text)
    call_command("add_scenario", "--file", str(folder / name))


def test_a_csv_file_is_added_row_by_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    add(tmp_path, "many.csv", CSV)
    assert capsys.readouterr().out.splitlines() == [
        "Added scenario one.",
        "Added scenario street-jaywalker-1.",
        "2 scenarios.",
    ]
    one = Scenario.objects.get(slug="one")
    assert (one.type, one.type_label, one.keep_traffic) == ("cut_in", "Cut-in", True)
    assert one.instruction == "Let a car cut in, closely."
    assert Scenario.objects.get(slug="street-jaywalker-1").reference is not None


def test_a_yaml_file_is_added_too(tmp_path: Path) -> None:
    add(tmp_path, "many.yaml", YAML)
    made = Scenario.objects.filter(type="cut_in").order_by("slug")
    assert [(row.slug, row.keep_traffic) for row in made] == [
        ("street-cut-in-1", False),
        ("street-cut-in-2", True),
    ]
    assert Scenario.objects.get(slug="street-jaywalker-1").reference == json.loads(CHANGE)


def test_one_bad_row_keeps_all_out_and_every_error_is_named(tmp_path: Path) -> None:
    wrong = (
        CSV
        + """nowhere,cut_in,Something.,,,
street,cut_in,Something.,,maybe,
street,cut_in,,,,
"""
    )
    with pytest.raises(CommandError) as refused:
        add(tmp_path, "many.csv", wrong)
    said = str(refused.value)
    for words in (
        "row 3: Unknown scene 'nowhere'",
        "row 4.keep_traffic: 'maybe' must be yes or no",
        "row 5.instruction: is missing",
    ):
        assert words in said
    assert not Scenario.objects.exists()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("many.txt", CSV, "must end in .csv, .yaml or .yml"),
        ("many.csv", "scene,type\n", "0 rows"),
        ("many.csv", "scene,colour\nstreet,red\n", "row 1.colour: is no column"),
        ("many.yaml", "a: 1", "a list of mappings is needed"),
        ("many.yaml", "- {scene: 3, type: cut_in, instruction: x}", "row 1.scene: 3 must be text"),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path: Path, name: str, text: str, words: str) -> None:
    with pytest.raises(CommandError) as refused:
        add(tmp_path, name, text)
    assert words in str(refused.value)
