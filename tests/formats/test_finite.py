"""No file says NaN, and an ego that nobody recorded is there at every step of every format."""

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.formats.writers import WRITERS, writer_named
from augment.formats.writing import Output
from augment.scene.codec import recording_from_document
from augment.scene.recording import Recording
from tests.formats.cells import cell, crossing, recorded_street
from tests.formats.sanity import loaded
from tests.properties import examples
from tests.scenes import curve, junction, scene, vehicle

SCENES = (scene(), curve(), junction(), crossing())


def not_finite(value: Any) -> bool:
    """Whether NaN or an infinity is anywhere in a structure of a pickle."""
    if isinstance(value, dict):
        return any(not_finite(one) for one in value.values())
    if isinstance(value, list | tuple | set):
        return any(not_finite(one) for one in value)
    if isinstance(value, float | np.ndarray) and np.asarray(value).dtype.kind == "f":
        return not np.isfinite(value).all()
    return False


def check_finite_files(written: Output) -> None:
    for name, content in written.files.items():
        if name.endswith(".pkl"):
            assert not not_finite(loaded(content)), name
        else:
            assert not re.search(rb"\b(nan|infinity|inf)\b", content, re.IGNORECASE), name


@pytest.mark.parametrize("form", sorted(WRITERS))
@examples(12)
@given(data=st.data())
def test_no_file_says_nan_whatever_of_the_ego_and_the_others_was_recorded(
    form: str, data: st.DataObject
) -> None:
    before, whole = recorded_street()
    before = replace(data.draw(st.sampled_from(SCENES)), agents=before.agents)
    speed_mps = data.draw(st.sampled_from([0.0, 0.3, 8.0]))
    before = replace(before, ego=replace(before.ego, speed_mps=speed_mps))
    steps = data.draw(st.integers(min_value=1, max_value=31))
    ego = whole.ego[:steps].copy()
    hidden = data.draw(st.sets(st.integers(min_value=1, max_value=30)))
    ego[[row for row in hidden if row < steps]] = np.nan
    tracks = []
    for track in whole.tracks:
        states = track.states[:steps].copy()
        states[data.draw(st.integers(min_value=1, max_value=31)) :] = np.nan
        tracks.append(replace(track, states=states))
    thin = Recording(times_s=whole.times_s[:steps], ego=ego, tracks=tuple(tracks))
    made = cell(before, recording=thin, keeps_traffic=True, added=())
    written = writer_named(form)([made])
    assert not written.refused
    check_finite_files(written)
    assert np.isfinite(made.motion.ego.states).all()


@pytest.mark.parametrize("form", sorted(WRITERS))
def test_what_is_not_finite_is_refused_and_the_rest_is_written(form: str) -> None:
    nowhere = cell(stem="nowhere", added=(vehicle("Agent2", np.nan, 0.0),), name="nowhere")
    lost = cell(name="lost")
    lost.motion.ego.states[5, 0] = np.nan
    written = writer_named(form)([nowhere, lost, cell()])
    assert [one.cell for one in written.refused] == ["nowhere", "lost"]
    assert "agents[0].x_m" in written.refused[0].text
    assert written.refused[1].text == "Agent1 is at no finite place in step 5"
    assert written.files
    check_finite_files(written)


def test_a_drive_that_nobody_recorded_is_not_in_our_own_json() -> None:
    before, recording = recorded_street()
    recording.ego[1:] = np.nan
    made = cell(before, recording=recording, added=())
    written = writer_named("json")([made]).files[f"{made.stem}.recording.json"]
    is_seen = recording_from_document(json.loads(written)).ego_is_seen.tolist()
    assert is_seen == [True] + [False] * 30
