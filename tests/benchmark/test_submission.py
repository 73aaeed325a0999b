"""A submission is read file by file, and its report is the same wherever it is computed."""

import json
import zipfile
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.benchmark import submission
from augment.benchmark.folder import checksum, read_folder
from augment.benchmark.report import report_to_document
from augment.benchmark.submission import check_submission
from augment.benchmark.values import EntryStatus, SubmittedEntry
from augment.errors import InvalidDocument
from augment.scene.codec import modification_to_document, scene_to_document
from augment.scene.entities import Modification, apply
from augment.scene.planned_motion import LanePath, PlannedMotion
from tests.benchmark.sets import handed_out, on_disk, street, street_set
from tests.benchmark.test_report import CARD_PARTS
from tests.scenes import cone

STREETS = street_set("near", "far", "closed")
CONE = Modification(added=(cone("mine", 12.0, 1.5),))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A submission without answers."""
    made = tmp_path / "mine"
    made.mkdir()
    write(made, "card.json", CARD_PARTS)
    return made


def write(folder: Path, name: str, document: object) -> None:
    (folder / name).write_text(json.dumps(document))


def entries(folder: Path) -> dict[str, SubmittedEntry]:
    report = check_submission(STREETS, folder, checksum="ab" * 32)
    return {f"{one.task}--{one.sample}": one for one in report.entries}


def test_each_task_and_sample_gets_its_status_file_and_reason(folder: Path) -> None:
    write(folder, "card.json", CARD_PARTS | {"samples": 2})
    write(folder, "near.json", modification_to_document(CONE))
    write(folder, "near--2.json", scene_to_document(apply(street(), CONE)))
    write(folder, "far.modification.json", modification_to_document(Modification()))
    write(folder, "far--2.json", modification_to_document(Modification(removed=("Agent99",))))
    write(folder, "closed.json", {"format": "scenario-arena/intent", "version": 1})
    (folder / "closed--2.xml").write_text("<nothing/>")
    (folder / "closed--2.json").write_text("{}")
    found = entries(folder)
    assert {key: str(one.status) for key, one in found.items()} == {
        **{"near--1": "read", "near--2": "read", "far--1": "refused", "far--2": "unreadable"},
        **{"closed--1": "unreadable", "closed--2": "unreadable"},
    }
    assert found["far--2"].file == "far--2.json"
    assert found["far--2"].reason.startswith("does not fit its scene: Agent99 is not in the scene")
    assert "format: expected 'scenario-arena/modification' or" in found["closed--1"].reason
    assert found["closed--2"].reason == "2 files are for it; one is needed"
    for sample in (found["near--1"], found["near--2"]):
        assert [one.id for one in sample.modification.added] == ["Agent12"]


def test_lctgens_vehicles_are_added_on_the_lanes_of_the_scene(folder: Path) -> None:
    ego, oncoming = [0.0] * 5 + [4.6, 1.9], [30.0, 3.4, -6.0, 0.0, 3.1, 4.4, 1.8]
    np.savez(folder / "far.npz", agent=np.array([ego, oncoming]))
    found = entries(folder)["far--1"]
    (added,) = found.modification.added
    assert (added.id, added.lane_id, added.speed_mps) == ("Agent12", "Lane2", 6.0)
    assert found.notes[0].startswith("LCTGen says nothing of other road users")


def test_a_lane_that_is_not_there_does_not_fit(folder: Path) -> None:
    lost = replace(CONE.added[0], lane_id="Lane77")
    write(folder, "near.json", modification_to_document(Modification(added=(lost,))))
    assert "'Lane77' is not a lane" in entries(folder)["near--1"].reason
    motion = PlannedMotion(path=LanePath(lane_ids=("Lane77",)))
    led_astray = replace(CONE.added[0], motion=motion)
    write(folder, "near.json", modification_to_document(Modification(added=(led_astray,))))
    assert "Lane77 is no lane of the scene; its lanes: " in entries(folder)["near--1"].reason


def test_files_of_no_task_are_remarks_and_a_zip_of_the_folder_is_read(folder: Path) -> None:
    write(folder, "near.json", modification_to_document(CONE))
    (folder / "README.md").write_text("Hello")
    (folder / "near--2.json").write_text("{}")
    packed = folder.parent / "mine.zip"
    with zipfile.ZipFile(packed, "w") as file:
        for one in folder.iterdir():
            file.write(one, f"mine/{one.name}")
    reports = [check_submission(STREETS, one, checksum="ab" * 32) for one in (folder, packed)]
    assert reports[0] == reports[1]
    assert [one.partition(" ")[0] for one in reports[0].remarks] == ["README.md", "near--2.json"]
    assert [one.status for one in reports[0].entries] == [
        EntryStatus.READ,
        EntryStatus.MISSING,
        EntryStatus.MISSING,
    ]


@pytest.mark.parametrize("change", [{"name": ""}, None], ids=["a wrong card", "no card"])
def test_without_a_card_nothing_is_taken(folder: Path, change: dict[str, Any] | None) -> None:
    if change is None:
        (folder / "card.json").unlink()
    else:
        write(folder, "card.json", CARD_PARTS | change)
    with pytest.raises(InvalidDocument, match=r"card\.json: is missing|name: String should have"):
        entries(folder)


def test_the_server_says_the_same_to_the_last_digit_and_scores_practice_alone(
    folder: Path, tmp_path: Path
) -> None:
    """The server knows all references, the folder that was handed out those of practice."""
    shown = on_disk(tmp_path / "shown", STREETS)
    placed = modification_to_document(Modification(added=(cone("mine", 0.1 + 0.2, 1 / 3),)))
    for name in ("near", "far"):
        write(folder, f"{name}.json", placed)
    offline = read_folder(shown)
    assert offline == handed_out(STREETS)
    documents = [
        report_to_document(check_submission(one, folder, checksum=checksum(one)))
        for one in (STREETS, offline)
    ]
    assert json.dumps(documents[0]) == json.dumps(documents[1])
    assert ["displacement" in one for one in documents[0]["entries"]] == [True, False, False]
    out = StringIO()
    call_command(  # no database: this test may not reach one
        "check_submission", str(folder), "--benchmark", str(shown), stdout=out
    )
    distance_m = documents[0]["entries"][0]["displacement"]["matches"][0]["distance_m"]
    assert (
        f"near    read        near.json  {distance_m!r} m, 1 missing, 0 surplus" in out.getvalue()
    )
    (folder / "card.json").unlink()
    with pytest.raises(CommandError) as fault:
        call_command("check_submission", str(folder), "--benchmark", str(shown))
    assert str(fault.value) == (
        "The submission was not taken. This submission can't be read: card.json: is missing"
    )
    assert fault.value.returncode == 1


def test_practice_tasks_that_were_not_read_miss_all_of_the_reference(folder: Path) -> None:
    found = entries(folder)["near--1"].displacement
    assert (found.matches, found.missing) == ((), ("Agent12", "Agent13"))


def test_a_submission_holds_so_many_agents_together_and_gets_so_many_remarks(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("near.json", "far.json", *(f"stray-{n}.json" for n in range(102))):
        write(folder, name, modification_to_document(CONE))
    remarks = check_submission(STREETS, folder, checksum="ab" * 32).remarks
    assert remarks[99:] == (
        "stray-97.json belongs to no task and sample: not read.",
        "2 others belong to none either.",
    )
    monkeypatch.setattr(submission, "MOST_TOGETHER", 1)
    with pytest.raises(InvalidDocument, match="more than 1 agents in all files together"):
        check_submission(STREETS, folder, checksum="ab" * 32)
