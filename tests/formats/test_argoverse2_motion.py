from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.argoverse2 import ArgoverseMotion
from augment.formats.readers import recognise
from augment.formats.reading import Reading
from augment.scene.codec import scene_to_document
from augment.scene.entities import AgentType
from tests.formats.av2_motion import row, rows, write_scenario

READER = ArgoverseMotion()


def read(path: Path, *, item: str | None = None, frame: int | None = None) -> Reading:
    return READER.read(path, item=item, frame=frame, name="made")


def fault_of(path: Path, **choice: Any) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(path, **choice)
    return str(caught.value)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "made")


def test_t0_is_the_last_observed_step_and_the_future_is_kept(folder: Path) -> None:
    reading = read(folder)
    scene, recording = reading.scene, reading.recording
    scene_to_document(scene)
    assert reading.moment.frame == 49
    assert (scene.origin.pose.x_m, scene.origin.pose.y_m) == pytest.approx((100.0, 201.42))
    assert scene.ego.lane_id is not None
    assert scene.ego.speed_mps == 10.0
    assert len(recording.times_s) == 61
    assert recording.times_s[-1] == pytest.approx(6.0)
    assert recording.ego[-1, :2].tolist() == pytest.approx([60.0, 0.0])


def test_everybody_has_the_usual_size_and_that_is_said(folder: Path) -> None:
    reading = read(folder)
    static, walker, cyclist = reading.scene.agents
    assert (static.type, walker.type, cyclist.type) == (
        AgentType.GENERIC_OBJECT,
        AgentType.PEDESTRIAN,
        AgentType.BICYCLE,
    )
    assert (cyclist.x_m, cyclist.y_m, cyclist.speed_mps) == pytest.approx((38.58, 4.0, 5.0))
    assert abs(cyclist.heading_rad) == pytest.approx(np.pi, abs=1e-3)
    assert (walker.length_m, walker.width_m) == (0.9, 0.791)
    assert "3 of 3 objects got the usual size of their class." in reading.notes
    assert any("licence, CC BY-NC-SA 4.0, does not allow" in note for note in reading.notes)


def test_another_track_can_be_the_ego(folder: Path) -> None:
    scene = read(folder, item="7", frame=0).scene
    assert scene.origin.pose.heading_rad == pytest.approx(-np.pi / 2)
    assert "ego 7" in scene.provenance
    assert "unknown '12'; known: AV, 7, 9, 8" in fault_of(folder, item="12")
    assert "there are 0 to 109" in fault_of(folder, frame=110)
    assert "0 has no ego" in fault_of(folder, item="8", frame=0)


def test_folder_and_file_are_recognised(folder: Path) -> None:
    assert (
        recognise(folder).name == recognise(folder / "scenario_made.parquet").name == READER.name
    )
    assert [one.frame for one in READER.moments(folder, every_s=3.0)] == [0, 30, 60, 90]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"object_type": "tank"}, "kinds of objects (1); first object_type: unknown 'tank'"),
        ({"position_x": float("nan")}, "with a gap or an odd number was left out."),
        ({"timestep": 2**40}, "not from 0 to 9999 was left out."),
        ({"track_id": None}, "with a gap or an odd number was left out."),
        ({"track_id": "9"}, "Of two boxes of one object at one step the first counts."),
    ],
)
def test_a_broken_row_is_noted(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    table = [*rows(), row("10", "vehicle", 49, 100.0, 250.0) | change]
    reading = read(write_scenario(tmp_path / "made", table=table))
    assert said in " ".join(reading.notes)
    assert len(reading.scene.agents) == 3


def test_what_is_missing_is_named(tmp_path: Path) -> None:
    table = [{key: value for key, value in one.items() if key != "heading"} for one in rows()]
    assert "'heading'" in fault_of(write_scenario(tmp_path / "one", table=table))
    folder = write_scenario(tmp_path / "two")
    file = folder / "scenario_made.parquet"
    # The name in the Arrow schema, and not the one in Parquet's own.
    file.write_bytes(file.read_bytes().replace(b"object_type", b"object_tyqe", 1))
    assert "can't be read" in fault_of(folder)
    (folder / "scenario_made.parquet").write_bytes(b"PAR1 no")
    assert "can't be read" in fault_of(folder)
    (folder / "log_map_archive_made.json").unlink()
    (folder / "scenario_made.parquet").unlink()
    assert "0 such files" in fault_of(folder)
