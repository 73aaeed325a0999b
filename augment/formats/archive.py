"""Zips from strangers, unpacked within bounds, and what in a folder can be read.

A zip is believed in nothing: the names, sizes and kinds of all entries are looked at before
anything is written.
"""

from __future__ import annotations

import shutil
import stat
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from augment.errors import InvalidDocument
from augment.formats.reading import Reader

WHAT = "zip"
_DEEPEST = 50
"""Folders in each other; making and removing very deep ones recurses until it breaks."""
_UNREADABLE = (
    *(zipfile.BadZipFile, zlib.error, EOFError, struct.error),
    *(NotImplementedError, UnicodeDecodeError),  # zipfile's faults for odd flags and names
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ZipBounds:
    """What a zip may hold at most."""

    entries: int = 20_000
    bytes: int = 2_000_000_000


USUAL_BOUNDS = ZipBounds()


def is_zip(path: Path) -> bool:
    """Whether a file begins as a zip with entries does; its name says nothing."""
    with path.open("rb") as file:
        return file.read(4) == b"PK\x03\x04"


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
    try:
        with zipfile.ZipFile(path) as packed:
            listed = packed.infolist()
            entries = [one for one in listed if not (one.is_dir() or _is_of_the_system(one))]
            _check_all(entries, bounds)
            for entry in entries:
                _unpack(packed, entry, into / entry.filename)
    except _UNREADABLE as fault:
        raise InvalidDocument(WHAT, [("", f"is broken: {fault}")]) from None


def find_input(folder: Path, readers: list[Reader]) -> tuple[Reader, Path]:
    """What in an unpacked folder one of the readers takes, and which.

    The folder itself comes first, then what lies in it, level by level.

    Raises:
        InvalidDocument: Nothing in it is in one of the formats, or several things are.
    """
    level = [folder]
    while level:
        found = [(r, path) for path in sorted(level) for r in readers if r.recognises(path)]
        if len(found) == 1:
            return found[0]
        if found:
            names = ", ".join(
                f"{path.relative_to(folder).as_posix()} ({reader.name})"
                for reader, path in found[:5]
            )
            text = f"holds {len(found)} recordings, one is needed: {names}"
            raise InvalidDocument(WHAT, [("", text)])
        level = [below for path in level if path.is_dir() for below in path.iterdir()]
    known = ", ".join(f"{reader.name}: {reader.title}" for reader in readers)
    raise InvalidDocument(WHAT, [("", f"nothing in it is {known}")])


# Private


def _unpack(packed: zipfile.ZipFile, entry: zipfile.ZipInfo, place: Path) -> None:
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with packed.open(entry) as source, place.open("xb") as file:
            shutil.copyfileobj(source, file)  # no more than the entry says
    except (FileExistsError, NotADirectoryError):
        raise InvalidDocument(
            WHAT, [(_shown(entry), "is there twice, or lies in a file")]
        ) from None
    except OSError as fault:
        raise InvalidDocument(
            WHAT, [(_shown(entry), f"can't be unpacked: {fault.strerror}")]
        ) from None


def _check_all(entries: list[zipfile.ZipInfo], bounds: ZipBounds) -> None:
    """Do nothing where all may be unpacked.

    Raises:
        InvalidDocument: There are too many, or one of them may not.
    """
    total = sum(entry.file_size for entry in entries)
    if len(entries) > bounds.entries:
        raise InvalidDocument(WHAT, [("", f"holds more than {bounds.entries} entries")])
    if total > bounds.bytes:
        text = f"unpacks to {total} bytes, at most {bounds.bytes} are read"
        raise InvalidDocument(WHAT, [("", text)])
    if not entries:
        raise InvalidDocument(WHAT, [("", "holds no file")])
    problems = [(_shown(entry), problem) for entry in entries if (problem := _problem(entry))]
    if problems:
        raise InvalidDocument(WHAT, problems[:1])


def _problem(entry: zipfile.ZipInfo) -> str:
    """What keeps an entry from being unpacked, empty for nothing."""
    name, place = entry.filename, PurePosixPath(entry.filename)
    if place.is_absolute() or ".." in place.parts or not place.parts:
        return "is no name within the folder"
    if "\\" in name or ":" in name or not name.isprintable() or len(place.parts) > _DEEPEST:
        return "is no name within the folder"
    if entry.flag_bits & 0x1:
        return "is encrypted"
    if stat.S_IFMT(entry.external_attr >> 16) not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a special file"
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return "is packed in another way than the usual one"
    return ""


def _is_of_the_system(entry: zipfile.ZipInfo) -> bool:
    """What file managers add and nobody meant."""
    place = PurePosixPath(entry.filename)
    return "__MACOSX" in place.parts or place.name in (".DS_Store", "Thumbs.db")


def _shown(entry: zipfile.ZipInfo) -> str:
    return repr(entry.filename[:80])
