"""Recordings as JSON documents and back, exactly; a step where one was not seen is null.

Frame: the ego frame of t0. T steps. `columns` says what the four numbers of a state are.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.scene.recording import Recording
from augment.scene.schema import path, read, write

RECORDING_FORMAT = "scenario-arena/recording"
COLUMNS = ["x_m", "y_m", "heading_rad", "speed_mps"]

_RECORDING = TypeAdapter(Recording)


def recording_to_document(recording: Recording) -> dict[str, Any]:
    """The recording as a JSON document.

    Raises:
        InvalidDocument: The recording breaks a rule of the format.
    """
    document = write(recording, _RECORDING, format_name=RECORDING_FORMAT)
    format_and_version = {name: document.pop(name) for name in ("format", "version")}
    document = {**format_and_version, "columns": list(COLUMNS), **document}
    recording_from_document(document)
    return document


def recording_from_document(document: object) -> Recording:
    """The recording that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    what, columns = "recording", None
    if isinstance(document, dict):
        columns = document.get("columns")
        document = {name: part for name, part in document.items() if name != "columns"}
    recording = read(document, _RECORDING, what=what, format_name=RECORDING_FORMAT)
    problems = list(_problems(recording))
    if columns != COLUMNS:
        problems.append(("columns", f"expected {', '.join(COLUMNS)} in this order"))
    if problems:
        raise InvalidDocument(what, problems)
    return recording


# Private


def _problems(given: Recording) -> Iterator[tuple[str, str]]:
    times_s = given.times_s.tolist()
    if times_s[0] != 0.0:
        yield path("times_s", 0), f"the first step is t0: 0, got {times_s[0]}"
    for index, (before, after) in enumerate(pairwise(times_s), start=1):
        if after <= before:
            yield path("times_s", index), f"{after} does not follow {before}"
    if len(given.ego) and np.isnan(given.ego[0]).all():
        yield path("ego", 0), "the ego is there at t0"
    lengths = [("ego", len(given.ego))]
    lengths += [(path("tracks", i, "states"), len(t.states)) for i, t in enumerate(given.tracks)]
    for place, length in lengths:
        if length != len(times_s):
            yield place, f"expected {len(times_s)} states, one a step, got {length}"
    seen: set[str] = set()
    for index, track in enumerate(given.tracks):
        if track.agent_id in seen:
            yield path("tracks", index, "agent_id"), f"{track.agent_id!r} has a track already"
        seen.add(track.agent_id)
