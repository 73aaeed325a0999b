"""The project's own JSON: a scene as it is stored, and all of a change.

Nothing is lost on the way out, and what is read again is the same.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from augment.foreign import fault_at
from augment.formats.documents import read_json
from augment.formats.reading import Moment, Reader, Reading
from augment.formats.writing import Cell, LossReport, Output, write_each
from augment.scene import codec
from augment.scene.motion import MotionSource
from augment.scene.recording import Recording, to_track


class OwnJson(Reader):
    """The reader of a scene document."""

    name = "json"
    title = "scene in the own JSON (file)"
    suffix, marker = ".json", codec.SCENE_FORMAT.encode()

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """The one."""
        yield Moment()

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene under another name."""
        if frame or item is not None:
            raise fault_at("frame", "a JSON scene has no parts and frame 0 alone")
        scene = codec.scene_from_document(read_json(path, what="scene"))
        return Reading(scene=replace(scene, name=name), recording=None)


def write(cells: Sequence[Cell]) -> Output:
    """For each cell the scene before and after its change, the change, and the tracks."""
    return write_each(cells, _write_one)


# Private


def _write_one(cell: Cell, report: LossReport) -> dict[str, bytes]:
    documents = {
        "before": codec.scene_to_document(cell.scene),
        "scene": codec.scene_to_document(cell.after),
        "modification": codec.modification_to_document(cell.modification),
    }
    if cell.recording is not None:
        documents["recording"] = codec.recording_to_document(_recording(cell))
    return {f"{cell.stem}.{name}.json": _text(document) for name, document in documents.items()}


def _recording(cell: Cell) -> Recording:
    """Return the part of a recording that a log contains, without assumptions."""
    motion = replace(cell, expected=None).motion  # what rules move was not recorded
    ego = motion.ego.states.copy()
    if motion.ego.source is not MotionSource.RECORDED:
        ego[1:] = np.nan  # written as null: nobody recorded it
    return Recording(
        times_s=motion.times_s,
        ego=ego,
        tracks=tuple(
            to_track(other.agent, np.where(other.is_present[:, None], other.states, np.nan))
            for other in motion.others
            if other.source is MotionSource.RECORDED
        ),
    )


def _text(document: dict[str, Any]) -> bytes:
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()
