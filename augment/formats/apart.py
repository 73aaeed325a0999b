"""Scenes out of files and folders from outside, each read in a process of its own (`sandbox`).

In: a path, and the name of a format where it is known. Out: what `readers` gives. Whoever wants a
recording comes here; the readers themselves run in the process alone, which unpacks a zip first.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.formats import sandbox
from augment.formats.apart import find_input, is_zip, unpack_zip
from augment.formats.nuplan_log import tokens_in
from augment.formats.readers import READERS, Timeline, reader_of, recognise, timeline_of
from augment.formats.reading import Moment, Reader, Reading
from augment.scene.codec import (
    recording_from_document,
    recording_to_document,
    scene_from_document,
    scene_to_document,
)
from augment.scene.recording import notes_from_document, notes_to_document

_MOMENT, _MOMENTS = TypeAdapter(Moment), TypeAdapter(list[Moment])
_TIMELINE, _TOKENS = TypeAdapter(Timeline), TypeAdapter(tuple[str, ...])


@dataclass(frozen=True, slots=True, kw_only=True)
class UntrustedInput:
    """A file or folder from outside.

    Attributes:
        path: A zip is unpacked for as long as it is read.
        format: The name of a reader; None to recognise it.
    """

    path: Path
    format: str | None = None

    def look(self) -> tuple[str, Timeline]:
        """Return the format's name, and what the recording offers to choose from.

        Raises:
            UnknownName: No such format.
            InvalidDocument: The input breaks its format, or the limits of its process.
        """
        name, timeline = self._ask("look")
        return name, _TIMELINE.validate_python(timeline)

    def moments(self, *, every_s: float) -> list[Moment]:
        """Return what can be taken, so many seconds apart.

        Raises:
            UnknownName, InvalidDocument: As above.
        """
        _, moments = self._ask("moments", every_s=every_s)
        return _MOMENTS.validate_python(moments)

    def read(self, *, item: str | None, frame: int | None, name: str) -> tuple[str, Reading]:
        """Return the format's name, and the scene at one moment; see `Reader.read`.

        Raises:
            UnknownName, InvalidDocument: As above.
        """
        source, found = self._ask("read", item=item, frame=frame, name=name)
        recording = found["recording"]
        return source, Reading(
            scene=scene_from_document(found["scene"]),
            recording=None if recording is None else recording_from_document(recording),
            notes=notes_from_document(found["notes"]),
            moment=_MOMENT.validate_python(found["moment"]),
        )

    def tokens(self, wanted: Sequence[str]) -> tuple[str, ...]:
        """Return those of some tokens that a nuPlan log has a lidar_pc of.

        Raises:
            UnknownName, InvalidDocument: As above.
        """
        _, tokens = self._ask("tokens", wanted=list(wanted))
        return _TOKENS.validate_python(tokens)

    def _ask(self, what: str, **more: Any) -> tuple[str, Any]:
        if self.format is not None:
            reader_of(self.format)
        path = self.path.resolve()
        if not path.exists():
            raise InvalidDocument("input", [(str(self.path), "is not there")])
        with tempfile.TemporaryDirectory(prefix="arena-reading-") as folder:
            request = {"what": what, "path": str(path), "format": self.format, "folder": folder}
            source, found = sandbox.run(__name__, request | {"more": more}, name=path.name)
        return reader_of(source).name, found


# The other side: what runs in the process.


def _answer(request: dict[str, Any]) -> tuple[str, Any]:
    path, name, folder = Path(request["path"]), request["format"], Path(request["folder"])
    # Names without a place on this machine, as they are said in reasons.
    if path.is_file() and is_zip(path):
        (folder / path.stem).mkdir()
        unpack_zip(path, folder / path.stem)
        os.chdir(folder)
        candidates = [reader_of(name)] if name else list(READERS.values())
        reader, path = find_input(Path(path.stem), candidates)
    else:
        os.chdir(path.parent)
        path = Path(path.name)
        reader = reader_of(name) if name else recognise(path)
    return reader.name, _ANSWERS[request["what"]](reader, path, **request["more"])


def _look(reader: Reader, path: Path) -> Any:
    return _TIMELINE.dump_python(timeline_of(reader, path), mode="json")


def _moments(reader: Reader, path: Path, every_s: float) -> Any:
    return [asdict(moment) for moment in reader.moments(path, every_s=every_s)]


def _read(reader: Reader, path: Path, item: str | None, frame: int | None, name: str) -> Any:
    found = reader.read(path, item=item, frame=frame, name=name)
    return {
        "scene": scene_to_document(found.scene),
        "recording": None if found.recording is None else recording_to_document(found.recording),
        "notes": notes_to_document(found.notes),
        "moment": asdict(found.moment),
    }


def _tokens(_: Reader, path: Path, wanted: list[str]) -> Any:
    return tokens_in(path, wanted)


_ANSWERS: dict[str, Callable[..., Any]] = {
    "look": _look,
    "moments": _moments,
    "read": _read,
    "tokens": _tokens,
}

if __name__ == "__main__":
    sandbox.serve(_answer)
