"""Recordings as JSON documents and back, exactly; a step where one was not seen is null.

Frame: the ego frame of t0. T steps.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from augment.errors import InvalidDocument
from augment.scene.recording import Recording, Track
from augment.scene.schema import (
    RECORDING_FORMAT,
    VERSION,
    AgentTypeText,
    Document,
    Id,
    Size,
    path,
    read,
)

MOST_TRACKS = 50_000
COLUMNS = ["x_m", "y_m", "heading_rad", "speed_mps"]

Number = Annotated[float, Field(ge=-1e6, le=1e6)]
State = Annotated[list[Number], Field(min_length=4, max_length=4)]


class TrackDocument(Document):
    """A `Track`."""

    agent_id: Id
    type: AgentTypeText
    length_m: Size
    width_m: Size
    states: Annotated[list[State | None], Field(fail_fast=True)]


class RecordingDocument(Document):
    """A `Recording`; `columns` says what the four numbers of a state are."""

    format: str
    version: int
    columns: Annotated[
        list[Literal["x_m", "y_m", "heading_rad", "speed_mps"]],
        Field(min_length=4, max_length=4),
    ]
    times_s: Annotated[list[Number], Field(fail_fast=True, min_length=1)]
    ego: Annotated[list[State | None], Field(fail_fast=True)]
    tracks: Annotated[list[TrackDocument], Field(max_length=MOST_TRACKS)] = []


def recording_to_document(recording: Recording) -> dict[str, Any]:
    """The recording as a JSON document.

    Raises:
        InvalidDocument: The recording breaks a rule of the format.
    """
    document = {
        "format": RECORDING_FORMAT,
        "version": VERSION,
        "columns": list(COLUMNS),
        "times_s": recording.times_s.tolist(),
        "ego": _rows(recording.ego),
        "tracks": [
            {
                "agent_id": track.agent_id,
                "type": track.type,
                "length_m": track.length_m,
                "width_m": track.width_m,
                "states": _rows(track.states),
            }
            for track in recording.tracks
        ],
    }
    recording_from_document(document)
    return document


def recording_from_document(document: object) -> Recording:
    """The recording that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    given = read(document, RecordingDocument, what="recording", format_name=RECORDING_FORMAT)
    problems = _problems(given)
    if problems:
        raise InvalidDocument("recording", problems)
    return Recording(
        times_s=_frozen(given.times_s, (-1,)),
        ego=_frozen([row or [np.nan] * 4 for row in given.ego], (-1, 4)),
        tracks=tuple(
            Track(
                agent_id=track.agent_id,
                type=track.type.value,
                length_m=track.length_m,
                width_m=track.width_m,
                states=_frozen([row or [np.nan] * 4 for row in track.states], (-1, 4)),
            )
            for track in given.tracks
        ),
    )


# Private


def _rows(states: NDArray[np.float64]) -> list[list[float] | None]:
    return [None if np.isnan(row).all() else row.tolist() for row in states]


def _frozen(values: object, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = np.array(values, dtype=np.float64).reshape(shape)
    array.flags.writeable = False
    return array


def _problems(given: RecordingDocument) -> list[tuple[str, str]]:
    problems = []
    if list(given.columns) != COLUMNS:
        problems.append(("columns", f"expected {', '.join(COLUMNS)} in this order"))
    if given.times_s[0] != 0.0:
        problems.append((path("times_s", 0), f"the first step is t0: 0, got {given.times_s[0]}"))
    for index, (before, after) in enumerate(zip(given.times_s, given.times_s[1:], strict=False)):
        if after <= before:
            problems.append((path("times_s", index + 1), f"{after} does not follow {before}"))
    if given.ego and given.ego[0] is None:
        problems.append((path("ego", 0), "the ego is there at t0"))
    steps = len(given.times_s)
    lengths = [("ego", len(given.ego))]
    lengths += [(path("tracks", i, "states"), len(t.states)) for i, t in enumerate(given.tracks)]
    for place, length in lengths:
        if length != steps:
            problems.append((place, f"expected {steps} states, one a step, got {length}"))
    seen: set[str] = set()
    for index, track in enumerate(given.tracks):
        if track.agent_id in seen:
            text = f"{track.agent_id!r} has a track already"
            problems.append((path("tracks", index, "agent_id"), text))
        seen.add(track.agent_id)
    return problems
