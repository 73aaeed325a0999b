from __future__ import annotations

import json

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.scene.codec import recording_from_document, recording_to_document
from augment.scene.entities import AgentType
from augment.scene.recording import Recording, Track


def recording() -> Recording:
    """Three steps; Agent2 is not seen at the second."""
    unseen = [np.nan] * 4
    return Recording(
        times_s=np.array([0.0, 0.1, 0.2]),
        ego=np.array([[0.0, 0.0, 0.0, 1.0], [0.1, 0.0, 0.0, 1.0], [0.2, 0.01, 0.1, 1.0]]),
        tracks=(
            Track(
                agent_id="Agent2",
                type=AgentType.VEHICLE,
                length_m=4.8,
                width_m=2.0,
                states=np.array([[9.0, 1.0, 3.1, 2.0], unseen, [8.6, 1.0, 3.1, 2.0]]),
            ),
        ),
    )


def test_a_recording_survives_the_way_through_json_exactly() -> None:
    given = recording()
    text = json.dumps(recording_to_document(given), allow_nan=False)
    back = recording_from_document(json.loads(text))
    assert np.array_equal(back.times_s, given.times_s)
    assert np.array_equal(back.ego, given.ego)
    assert np.array_equal(back.tracks[0].states, given.tracks[0].states, equal_nan=True)
    assert back.tracks[0].agent_id == "Agent2"
    assert json.loads(text)["tracks"][0]["states"][1] is None


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"times_s": [0.1, 0.2, 0.3]}, "times_s[0]"),
        ({"times_s": [0.0, 0.2, 0.2]}, "times_s[2]"),
        ({"times_s": [0.0, 0.1]}, "ego"),
        ({"ego": [[0.0, 0.0, 0.0, 1.0]]}, "ego"),
        ({"columns": ["y_m", "x_m", "heading_rad", "speed_mps"]}, "columns"),
        ({"version": 3}, "version"),
    ],
)
def test_a_broken_recording_names_the_place(fields: dict[str, object], place: str) -> None:
    with pytest.raises(InvalidDocument) as caught:
        recording_from_document(recording_to_document(recording()) | fields)
    assert place in [where for where, _ in caught.value.problems]


def test_half_a_state_is_no_state() -> None:
    given = recording()
    given.tracks[0].states[0, 1] = np.nan
    with pytest.raises(InvalidDocument, match=r"tracks\[0\]\.states\[0\]\[1\]"):
        recording_to_document(given)
