from __future__ import annotations

from io import StringIO
from pathlib import Path

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.models import BaseScene, Scenario
from augment.scene.entities import AgentType
from augment.services.scenarios.scene_notes import notes_of
from augment.services.scenarios.scenes import reference_of, scene_of
from tests.formats.interplan_files import ELSEWHERE, HERE, write_folder

pytestmark = pytest.mark.django_db


def run(*arguments: object) -> list[str]:
    out = StringIO()
    call_command("import_interplan", *(str(one) for one in arguments), stdout=out)
    return out.getvalue().splitlines()


def refused(*arguments: object) -> str:
    with pytest.raises(CommandError) as caught:
        run(*arguments)
    return str(caught.value)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path)


def test_one_command_makes_scenarios_with_their_human_references(folder: Path) -> None:
    lines = run(folder)
    assert lines[0] == "Log 1 of 1, made.db: 1 base tokens"
    assert (
        f"{HERE}-s2: interplan-{HERE}-s2; left out: pedestrian 0 starts at iteration 12" in lines
    )
    assert any(
        line.startswith(f"{HERE}-s3: skipped.") and "5000 m from the ego" in line for line in lines
    )
    assert f"{ELSEWHERE}-s0: skipped. none of the logs has a frame of its base token" in lines
    assert lines[-1] == "3 scenarios imported, 0 were there already, 2 skipped."
    nudge = Scenario.objects.get(slug=f"interplan-{HERE}-s0")
    assert nudge.type == "nudge_around_parked_vehicle"
    assert scene_of(nudge).agents == (), "interPlan clears the recorded traffic"
    reference = reference_of(nudge)
    assert reference is not None
    (car,) = reference.added
    assert (car.x_m, car.y_m) == pytest.approx((17.5, -0.8), abs=1e-3)
    assert car.heading_rad == pytest.approx(0.05)
    assert car.lane_id == scene_of(nudge).ego.lane_id
    assert nudge.instruction == (
        "Have the ego nudge around what stands at the side of its lane: a parked vehicle "
        "17.5 m ahead of the ego and 0.8 m to its right, in the ego's direction."
    )
    zone = reference_of(Scenario.objects.get(slug=f"interplan-{HERE}-s1"))
    assert zone is not None
    assert [one.type for one in zone.added] == [
        *[AgentType.TRAFFIC_CONE] * 3,
        AgentType.PEDESTRIAN,
    ]


def test_what_cannot_be_kept_stands_on_the_scene(folder: Path) -> None:
    run(folder)
    row = BaseScene.objects.get(slug=f"interplan-{HERE}")
    assert HERE in row.provenance
    assert row.recording is not None
    notes = [str(note) for note in notes_of(row)]
    (left_out,) = [note for note in notes if note.startswith("What interPlan says besides")]
    for part in (
        "extra_agents_to_spawn (2)",
        "roadblock_locations_to_spawn_agents (1)",
        "goal (left ",
        f"{HERE}-s1: config dlgl",
    ):
        assert part in left_out
    assert any(note.startswith("The source's route leads over 2 roadblocks") for note in notes)


def test_importing_again_changes_nothing(folder: Path) -> None:
    run(folder)
    lines = run(folder)
    assert lines[-1] == "0 scenarios imported, 3 were there already, 2 skipped."
    assert f"{HERE}-s0: interplan-{HERE}-s0 was there already" in lines
    assert (BaseScene.objects.count(), Scenario.objects.count()) == (1, 3)


def test_sentences_of_somebodys_own_are_taken(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "sentences.csv"
    file.write_text(f'id,instruction\n{HERE}-s0,"Add a parked car, 17.5 m ahead."\n')
    run(folder, "--instructions", file)
    assert (
        Scenario.objects.get(slug=f"interplan-{HERE}-s0").instruction
        == "Add a parked car, 17.5 m ahead."
    )
    file.write_text("id,instruction\n0123456789abcdef-s0,Add a car.\n")
    assert "line 2: '0123456789abcdef-s0' is no special scenario" in refused(
        folder, "--instructions", file
    )


def test_nothing_imported_is_a_fault(folder: Path, tmp_path: Path) -> None:
    (log,) = folder.rglob("*.db")
    log.write_bytes(b"no database")
    assert refused(folder).startswith("0 scenarios imported, 0 were there already, 5 skipped.")
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "holds 0 YAML files with modification_details_dictionary" in refused(empty)
    assert not BaseScene.objects.exists()
