"""What a recording offers to choose from: moments with times, on the ego's way."""

import json
from pathlib import Path

import pytest

from augment.formats import readers
from augment.formats.readers import READERS, recognise, timeline_of
from augment.scene.codec import scene_to_document
from tests.formats.av2_logs import write_log
from tests.scenes import scene


def test_a_log_of_ten_metres_a_second_has_its_places_on_a_line(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log")
    [track] = timeline_of(READERS["av2"], log, every_s=0.1).tracks
    assert [stop.moment.frame for stop in track.stops] == [0, 1, 2, 3, 4]
    for number, stop in enumerate(track.stops):
        assert stop.moment.time_s == pytest.approx(0.1 * number)
        assert stop.place_m == pytest.approx((1.0 * number, 0.0), abs=0.02)
    assert track.roads_m


def test_a_single_scene_is_one_moment_at_the_origin(tmp_path: Path) -> None:
    file = tmp_path / "street.json"
    file.write_text(json.dumps(scene_to_document(scene())))
    found = timeline_of(recognise(file), file)
    [track] = found.tracks
    [stop] = track.stops
    assert (stop.moment.frame, stop.moment.time_s, stop.place_m) == (0, None, (0.0, 0.0))
    assert not found.is_cut


def test_of_a_long_recording_the_first_moments_are_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(readers, "MOST_STOPS", 3)
    found = timeline_of(READERS["av2"], write_log(tmp_path / "log"), every_s=0.1)
    assert (len(found.tracks[0].stops), found.is_cut) == (3, True)
