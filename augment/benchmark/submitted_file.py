"""Files of a submission, read in a process of its own (`sandbox`); nothing in them is run.

In: a folder and names in it. Out: one line of JSON a file, written as soon as it is read, so that
whoever asked knows over which file the process died. The process also opens a submission: it
unpacks a zip and reads the card.
"""

import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.escaping import escape_controls
from augment.foreign import fault_at
from augment.formats import lctgen, sandbox
from augment.formats.apart import ZipBounds, unpack_zip
from augment.formats.commonroad.writer import names_in
from augment.formats.documents import parse_json, read_json, read_text_file
from augment.formats.readers import READERS, recognise
from augment.formats.reading import Reader
from augment.formats.scenarionet.unpickling import read_pickle
from augment.scene.codec import MODIFICATION, SCENE_FORMAT
from augment.scene.entities import Modification, Scene
from augment.scene.schema import CLOSED, Codec

CARD_FILE = "card.json"
BOUNDS = ZipBounds(entries=10_000, bytes=500_000_000)
ENOUGH_S = 4.0
"""Of computing, after which the process stops: a file always has as much left of its limit."""
ONLY_T0 = (
    "What it says of the time after t0 is not taken: who is new or moved goes on by itself. A "
    "motion can be entered in our own JSON."
)
_HEAD_BYTES = 1_000_000
_MOST_SAID = 2_000
"""Characters of a reason, which may quote the file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FileContent:
    """Content of one file.

    Attributes:
        problem: Why it can't be read, empty where it can.
        format: The name of its format.
        modification: In our own JSON, or what LCTGen adds; None for a scene.
        scene: The changed scene, of which only ego, agents and origin are kept.
        names: What the file calls the agents, by their ids in the scene, as its reader says it.
        own_names: Our names for what the file calls so, where it says them.
    """

    __pydantic_config__ = CLOSED

    problem: str = ""
    format: str = ""
    notes: tuple[str, ...] = ()
    modification: Modification | None = None
    scene: Scene | None = None
    names: Mapping[str, str] | None = None
    own_names: Mapping[str, str] | None = None


CONTENT = Codec("file", TypeAdapter(FileContent))


def read_file(path: Path) -> FileContent:
    """Return the content of a file or of a format's folder.

    Raises:
        InvalidDocument: It is in no format that is read, or breaks its own.
    """
    suffix = path.suffix.lower()
    if path.is_symlink():
        raise fault_at(path.name, "is a link")
    if suffix == ".json":
        document = read_json(path, what="file")
        kind = document.get("format") if isinstance(document, Mapping) else None
        if kind == MODIFICATION.frame["format"]:
            return FileContent(format=kind, modification=MODIFICATION.from_document(document))
        if kind == SCENE_FORMAT:
            return _read_scene(READERS["json"], path)
        if kind is not None:
            allowed = f"{MODIFICATION.frame['format']!r} or {SCENE_FORMAT!r}"
            raise InvalidDocument("file", [("format", f"expected {allowed}, got {kind!a:.80}")])
        return _read_vehicles(document)
    if suffix == ".npz":
        return _read_vehicles(lctgen.read_arrays(path))
    if suffix == ".pkl" and path.is_file():
        document = read_pickle(path)
        if not isinstance(document, Mapping) or "map_features" not in document:
            return _read_vehicles(document)
    return _read_scene(recognise(path), path)


# Private


def _read_vehicles(document: object) -> FileContent:
    modification, notes = lctgen.read_vehicles(document)
    return FileContent(format=lctgen.NAME, modification=modification, notes=notes)


def _read_scene(reader: Reader, path: Path) -> FileContent:
    reading = reader.read(path, item=None, frame=None, name="submitted")
    own_names: Mapping[str, str] = {}
    if reader.name == "commonroad":
        with path.open("rb") as file:
            own_names = names_in(file.read(_HEAD_BYTES).decode(errors="replace"))
    scene = replace(reading.scene, lanes=(), connectors=(), areas=())
    notes = reading.notes if reading.recording is None else (*reading.notes, ONLY_T0)
    return FileContent(
        format=reader.name, scene=scene, notes=notes, names=reading.names, own_names=own_names
    )


def _tell(path: Path) -> dict[str, Any]:
    """Return a file's content as plain JSON, which can be read again."""
    try:
        content = read_file(path)
        notes = tuple(escape_controls(note) for note in content.notes)
        document: dict[str, Any] = CONTENT.dump(replace(content, notes=notes))
        CONTENT.from_parts(document)
        return document
    except InvalidDocument as fault:
        return {"problem": escape_controls(str(fault)[:_MOST_SAID])}
    except RecursionError:
        return {"problem": "This file can't be read: it is nested too deeply"}


def _open(path: Path, folder: Path) -> dict[str, Any]:
    """The card, the folder that it lies in, and the names beside it."""
    root = path
    if not path.is_dir():
        root = folder
        unpack_zip(path, folder, bounds=BOUNDS)
    within = [
        folder for folder in root.iterdir() if folder.is_dir() and (folder / CARD_FILE).is_file()
    ]
    if not (root / CARD_FILE).is_file():
        if len(within) != 1:
            raise InvalidDocument("submission", [(CARD_FILE, "is missing")])
        (root,) = within
    names = [entry.name for entry in root.iterdir() if not entry.name.startswith(".")]
    if len(names) > BOUNDS.entries:
        text = f"{len(names)} files; at most {BOUNDS.entries} are taken"
        raise InvalidDocument("submission", [("", text)])
    card = read_text_file(root / CARD_FILE, what="submission card")
    return {
        "root": str(root),
        "card": parse_json(card.encode(), what="submission card", place=CARD_FILE),
        "files": sorted(name for name in names if name != CARD_FILE),
    }


def _read(request: dict[str, Any]) -> None:
    os.chdir(request["root"])  # names without a place on this machine, as they stand in reasons
    with Path(request["told"]).open("w") as progress:
        for name in request["files"]:
            progress.write(json.dumps(_tell(Path(name)), allow_nan=False) + "\n")
            progress.flush()
            if time.process_time() > ENOUGH_S:
                return


def _answer(request: dict[str, Any]) -> dict[str, Any] | None:
    if request["what"] == "open":
        return _open(Path(request["path"]), Path(request["folder"]))
    _read(request)
    return None


if __name__ == "__main__":
    sandbox.serve(_answer)
