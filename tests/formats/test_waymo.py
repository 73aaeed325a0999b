from pathlib import Path

import pytest

from augment.errors import InvalidDocument
from augment.formats.reading import Reading
from augment.formats.waymo.scenario import WaymoMotion
from augment.scene.codec import scene_to_document
from augment.scene.entities import TrafficLight, TurnType
from tests.formats.waymo_files import lane, message, points, record, scenario, state, track, write


def read(path: Path, item: str | None = None, frame: int | None = None) -> Reading:
    return WaymoMotion().read(path, item=item, frame=frame, name="made")


def fault_of(path: Path, item: str | None = None, frame: int | None = None) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(path, item, frame)
    return str(caught.value)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "made.tfrecord", scenario(), scenario(ego=1))


def test_the_scene_is_that_of_the_current_step(file: Path) -> None:
    reading = read(file)
    scene, recording = reading.scene, reading.recording
    assert (reading.moment.item, reading.moment.frame) == ("0", 1)
    assert (scene.origin.pose.x_m, scene.ego.speed_mps) == (1001.0, 10.0)
    assert [(a.x_m, a.y_m, a.lane_id) for a in scene.agents] == [(20.0, 0.0, "Lane1")]
    assert recording.ego[:, 0].tolist() == [0.0, 1.0]
    scene_to_document(scene)


def test_lanes_have_widths_limits_lights_and_turns(file: Path) -> None:
    scene = read(file).scene
    street, after = scene.lanes
    assert (street.width_m, street.speed_limit_mps) == (4.0, 11.176)
    assert street.left_boundary.points_m[:, 1].tolist() == [2.0, 2.0]
    ways = {(c.turn_type, c.from_lane, c.to_lane, c.traffic_light) for c in scene.connectors}
    assert ways == {
        (TurnType.STRAIGHT, street.id, after.id, TrafficLight.GREEN),
        (TurnType.LEFT, street.id, None, TrafficLight.UNKNOWN),
    }
    later = read(file, frame=2).scene
    assert TrafficLight.RED in {c.traffic_light for c in later.connectors}


def test_each_record_is_an_item_and_each_step_a_moment(file: Path) -> None:
    found = list(WaymoMotion().moments(file, every_s=0.2))
    assert [(one.item, one.frame) for one in found] == [("0", 0), ("0", 2), ("1", 0), ("1", 2)]
    assert read(file, "1").scene.origin.pose.x_m == 1021.0
    for item in ("2", "x"):
        assert f"item: {item!r} is not there" in fault_of(file, item)
    assert "frame: 3 is not there" in fault_of(file, frame=3)


def test_a_record_that_breaks_the_format_costs_no_other(tmp_path: Path) -> None:
    bad, good = message((5, b"bad")), scenario()
    path = write(tmp_path / "x.tfrecord", bad, good, bad, good)
    assert {one.item for one in WaymoMotion().moments(path, every_s=1.0)} == {"1", "3"}
    reading = read(path)
    assert reading.moment.item == "1"
    assert "Passed over as unreadable: 1; This recording" in " ".join(reading.notes)
    assert "timestamps_seconds" in fault_of(path, "2")
    idle = (7, message((1, message((1, 77), (2, 4)))))
    notes = read(write(path, scenario(idle, (10, 9)))).notes
    assert "A traffic light governs no lane that is there." in notes
    assert "current times (1)" in " ".join(notes)


def test_wrong_checksums_and_cut_off_files_are_refused(file: Path) -> None:
    whole = file.read_bytes()
    for place, part in ((3, "length"), (40, "payload")):
        broken = bytearray(whole)
        broken[place] ^= 1
        file.write_bytes(broken)
        assert f"{part} with a wrong checksum" in fault_of(file)
    file.write_bytes(whole[:-1])
    assert "record 1: is cut off: 1 bytes" in fault_of(file, "1")
    file.write_bytes(whole + b"abc")
    assert "record 2: is cut off in its length" in fault_of(file, "2")


def test_a_broken_message_says_what_is_wrong(tmp_path: Path) -> None:
    for payload, said in (
        (scenario(ego=5), "sdc_track_index: unknown '5'"),
        (b"", "timestamps_seconds"),
        (
            message((1, message((1, message((1, b"state/current/x")))))),
            "take the data set's Scenario",
        ),
        (b"\x0b", "message: is broken"),
    ):
        assert said in fault_of(write(tmp_path / "x.tfrecord", payload))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (track(9, 7, *[state(0, 0, 0, 0)] * 3),
         "objects (1); first tracks[2].object_type: unknown"),
        (track(9, 1, state(0, 0, 0, 0)), "first tracks[2]: has 1 states for 3 times"),
        (lane(5, (2, 2), *points(8, (990, 503))), "lanes (1); first map_features.5: a line needs"),
        ((8, message((1, 6), (8, message(*points(1, (990, 503), (991, 503)))))), "areas (1)"),
        (lane(4, (2, 2), *points(8, (1060, 500), (1080, 500))),
         "Of two lanes with one id the last"),
        (lane(4, (2, 2), *points(8, (1060, 500), (1080, 500)), (13, message((3, 77)))),
         "edges of lanes (1); first map_features.4.boundary_feature_id: unknown '77'"),
        *(
            (
                lane(4, *points(8, (1060, 500), (1080, 500)), (13, message(*ends, (3, 9)))),
                "An edge of a lane counts as far as the lane's line goes.",
            )
            for ends in ([(1, 0), (2, 2)], [(1, 1), (2, 0)])
        ),
        (track(8, 1, *[state(1030, 500, 0.0, 0.0)] * 3),
         "Two objects have one id; both are taken."),
    ],
)  # fmt: skip
def test_a_bad_part_is_left_out_noted(tmp_path: Path, more: tuple[int, object], said: str) -> None:
    reading = read(write(tmp_path / "x.tfrecord", scenario(more)))
    assert said in " ".join(reading.notes)
    assert len(reading.scene.lanes) == 2


def test_it_is_recognised_by_its_first_checksum(file: Path, tmp_path: Path) -> None:
    assert WaymoMotion().recognises(file)
    other = tmp_path / "other"
    other.write_bytes(b"\0" * 100)
    assert not WaymoMotion().recognises(other)
    assert record(b"x").startswith(b"\x01" + b"\0" * 7)
