"""Many scenarios from one file: all of them, or none and every error with its row."""

import json
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command

from augment.models import Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.jobs.rows import add_scenario
from tests.scenes import cone

pytestmark = pytest.mark.django_db

CHANGE = modification_to_document(Modification(added=(cone("Agent2", 9.0, 0.0),)))
IN_CSV = json.dumps(CHANGE).replace('"', '""')
CSV = f"""scene,type,instruction,slug,keep_traffic,reference
street-scene,cut_in,"Let a car cut in, closely.",one,yes,
street-scene,jaywalking_pedestrian,Let somebody cross.,,,"{IN_CSV}"
"""
YAML = """
- {scene: street-scene, type: cut_in, instruction: Let a car cut in.}
- {scene: street-scene, type: cut_in, instruction: And another., keep_traffic: true}
- scene: street-scene
  type: jaywalking_pedestrian
  instruction: Let somebody cross.
  reference:
""" + json.dumps(CHANGE, indent=2).replace("\n", "\n    ").replace("{", "    {", 1)


@pytest.fixture(autouse=True)
def street() -> None:
    add_scenario("street")


def add(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text)
    call_command("add_scenario", "--file", str(folder / name))


def test_a_csv_file_is_added_row_by_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    add(tmp_path, "many.csv", CSV)
    assert capsys.readouterr().out.splitlines() == [
        "Added scenario one.",
        "Added scenario street-scene-jaywalker-1.",
        "2 scenarios.",
    ]
    one = Scenario.objects.get(slug="one")
    assert (one.type, one.type_label, one.keep_traffic) == ("cut_in", "Cut-in", True)
    assert one.instruction == "Let a car cut in, closely."
    assert Scenario.objects.get(slug="street-scene-jaywalker-1").reference is not None


def test_a_yaml_file_is_added_too(tmp_path: Path) -> None:
    add(tmp_path, "many.yaml", YAML)
    made = Scenario.objects.filter(type="cut_in").order_by("slug")
    assert [(row.slug, row.keep_traffic) for row in made] == [
        ("street-scene-cut-in-1", False),
        ("street-scene-cut-in-2", True),
    ]
    assert Scenario.objects.get(slug="street-scene-jaywalker-1").reference == CHANGE


def test_one_bad_row_keeps_all_out_and_every_error_is_named(tmp_path: Path) -> None:
    wrong = (
        CSV
        + """nowhere,cut_in,Something.,,,
street-scene,cut_in,Something.,,maybe,
street-scene,cut_in,,,,
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
    assert Scenario.objects.count() == 1


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("many.txt", CSV, "must end in .csv, .yaml or .yml"),
        ("many.csv", "scene,type\n", "0 rows"),
        ("many.csv", "scene,colour\nstreet-scene,red\n", "row 1.colour: is no column"),
        ("many.yaml", "a: 1", "a list of mappings is needed"),
        ("many.yaml", "- {scene: 3, type: cut_in, instruction: x}", "row 1.scene: 3 must be text"),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path: Path, name: str, text: str, words: str) -> None:
    with pytest.raises(CommandError) as refused:
        add(tmp_path, name, text)
    assert words in str(refused.value)
