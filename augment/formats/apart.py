"""Scenes out of files and folders from outside, each read in a process of its own (`sandbox`).

In: a path, and the name of a format where it is known. Out: what `readers` gives. Whoever wants a
recording comes here; the readers themselves run in the process alone, which unpacks a zip first.
"""

import os
import re
import shutil
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any

from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.formats import sandbox
from augment.formats.nuplan_log import vehicles_at
from augment.formats.readers import READERS, find_input, find_reader, recognise
from augment.formats.reading import LogReader, Moment, Reader, Reading
from augment.scene import codec

WHAT = "zip"
_DEEPEST = 50
"""Folders in each other; making and removing very deep ones recurses until it breaks."""
BROKEN_ZIP = (
    *(zipfile.BadZipFile, zlib.error, EOFError, struct.error),
    *(NotImplementedError, UnicodeDecodeError),  # zipfile's faults for odd flags and names
)
_MOMENT, _MOMENTS = TypeAdapter(Moment), TypeAdapter(list[Moment])
_TEXTS = TypeAdapter(tuple[str, ...])
_PLACES = TypeAdapter(dict[str, list[tuple[float, float, float]]])
_SIZES = TypeAdapter(dict[str, list[tuple[float, float]]])


@dataclass(frozen=True, slots=True, kw_only=True)
class UntrustedInput:
    """A file or folder from outside.

    Attributes:
        path: A zip is unpacked for as long as it is read.
        format: The name of a reader; None to recognise it.
        reach_m: How far from the ego the map of a recording goes; None for as far as usual.
    """

    path: Path
    format: str | None = None
    reach_m: float | None = None

    def moments(self, *, every_s: float, most: int) -> tuple[str, list[Moment]]:
        """Return the format's name, and the first moments, so many seconds apart.

        Raises:
            UnknownName: No such format.
            InvalidDocument: The input breaks its format, or the limits of its process.
        """
        name, moments = self._ask("moments", every_s=every_s, most=most)
        return name, _MOMENTS.validate_python(moments)

    def read(self, *, item: str | None, frame: int | None, name: str) -> tuple[str, Reading]:
        """Return the format's name, and the scene at one moment; see `Reader.read`.

        Raises:
            UnknownName, InvalidDocument: As above.
        """
        source, document = self._ask("read", item=item, frame=frame, name=name)
        recording = document["recording"]
        return source, Reading(
            scene=codec.scene_from_document(document["scene"]),
            recording=None if recording is None else codec.recording_from_document(recording),
            notes=_TEXTS.validate_python(document["notes"]),
            moment=_MOMENT.validate_python(document["moment"]),
            places=_PLACES.validate_python(document["places"]),
        )

    def vehicles(self, tokens: Sequence[str]) -> dict[str, list[tuple[float, float]]]:
        """Return the sizes of vehicles by those tokens that a nuPlan log has; see `vehicles_at`.

        Raises:
            UnknownName, InvalidDocument: As above.
        """
        return _SIZES.validate_python(self._ask("vehicles", tokens=list(tokens))[1])

    def _ask(self, what: str, **more: Any) -> tuple[str, Any]:
        if self.format is not None:
            find_reader(self.format)
        path = self.path.resolve()
        if not path.exists():
            raise InvalidDocument("input", [(str(self.path), "is not there")])
        with tempfile.TemporaryDirectory(prefix="arena-reading-") as folder:
            request = {"what": what, "path": str(path), "format": self.format, "folder": folder}
            more_still = {"reach_m": self.reach_m, "more": more}
            source, document = sandbox.run(__name__, request | more_still, name=path.name)
        return find_reader(source).name, document


# The other side: what runs in the process


def _answer(request: dict[str, Any]) -> tuple[str, Any]:
    path, name, folder = Path(request["path"]), request["format"], Path(request["folder"])
    # Names without a place on this machine, as they are said in reasons.
    if path.is_file() and (path.suffix.lower() == ".zip" or zipfile.is_zipfile(path)):
        (folder / path.stem).mkdir()
        unpack_zip(path, folder / path.stem)
        os.chdir(folder)
        candidates = [find_reader(name)] if name else list(READERS.values())
        reader, path = find_input(Path(path.stem), candidates, is_deep=True)
    else:
        os.chdir(path.parent)
        path = Path(path.name)
        reader = find_reader(name) if name else recognise(path)
    if request["reach_m"] and isinstance(reader, LogReader):
        reader.reach_m = request["reach_m"]  # in this process alone
    return reader.name, _ask_reader(reader, path, request["what"], request["more"])


def _ask_reader(reader: Reader, path: Path, what: str, more: dict[str, Any]) -> Any:
    """Return a reader's answer as plain JSON."""
    if what == "moments":
        moments = reader.moments(path, every_s=more["every_s"])
        return [asdict(moment) for moment in islice(moments, more["most"])]
    if what == "vehicles":
        return vehicles_at(path, more["tokens"])
    reading = reader.read(path, **more)
    return {
        "scene": codec.scene_to_document(reading.scene),
        "recording": None
        if reading.recording is None
        else codec.recording_to_document(reading.recording),
        "notes": reading.notes,
        "moment": asdict(reading.moment),
        "places": dict(reading.places),
    }


# Zips, which are believed in nothing: all entries are looked at before anything is written


@dataclass(frozen=True, slots=True, kw_only=True)
class ZipBounds:
    """Bounds on a zip's content."""

    entries: int = 20_000
    bytes: int = 2_000_000_000


USUAL_BOUNDS = ZipBounds()
_ADDED = re.compile(r"(^|/)(__MACOSX/|\.DS_Store$|Thumbs\.db$)")
"""What file managers add and nobody meant."""
_USUAL = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def unpack_zip(path: Path, into: Path, *, bounds: ZipBounds = USUAL_BOUNDS) -> None:
    """Write the files of a zip into an empty folder.

    Args:
        path: The zip.
        into: Where to; it exists. After an error half of them may lie there.
        bounds: What it may hold at most.

    Raises:
        InvalidDocument: It is no zip, is encrypted, leads out of the folder, holds links or other
            special files, a name twice, a file in a file, or more than the bounds allow.
    """
    place = ""
    try:
        with zipfile.ZipFile(path) as packed:
            entries = [
                member
                for member in packed.infolist()
                if not member.is_dir() and not _ADDED.search(member.filename)
            ]
            _check_entries(entries, bounds)
            for entry in entries:
                place, file = repr(entry.filename[:80]), into / entry.filename
                file.parent.mkdir(parents=True, exist_ok=True)
                with packed.open(entry) as source, file.open("xb") as written:
                    shutil.copyfileobj(source, written)  # no more than the entry says
        return
    except BROKEN_ZIP as fault:
        place, problem = "", f"is broken: {fault}"
    except (FileExistsError, NotADirectoryError):
        problem = "is there twice, or lies in a file"
    except OSError as fault:
        problem = f"can't be unpacked: {fault.strerror}"
    raise InvalidDocument(WHAT, [(place, problem)])


def _check_entries(entries: list[zipfile.ZipInfo], bounds: ZipBounds) -> None:
    """Raise InvalidDocument where there are too many, or one of them may not be unpacked."""
    total = sum(entry.file_size for entry in entries)
    if not 1 <= len(entries) <= bounds.entries or total > bounds.bytes:
        text = f"holds {len(entries)} files of {total} bytes; it needs 1 to {bounds.entries}"
        raise InvalidDocument(WHAT, [("", f"{text} of at most {bounds.bytes} together")])
    for entry in entries:
        name, place = entry.filename, PurePosixPath(entry.filename)
        leads_out = place.is_absolute() or ".." in place.parts or not place.parts
        is_odd = "\\" in name or ":" in name or not name.isprintable()
        problem = ""
        if leads_out or is_odd or len(place.parts) > _DEEPEST:
            problem = "is no name within the folder"
        elif stat.S_IFMT(entry.external_attr >> 16) not in (0, stat.S_IFREG, stat.S_IFDIR):
            problem = "is a link or a special file"
        elif entry.flag_bits & 0x1 or entry.compress_type not in _USUAL:
            problem = "is encrypted, or packed in another way than the usual one"
        if problem:
            raise InvalidDocument(WHAT, [(repr(name[:80]), problem)])


if __name__ == "__main__":
    sandbox.serve(_answer)
