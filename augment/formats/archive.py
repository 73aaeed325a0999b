"""Zips from strangers, unpacked within bounds, and what in a folder can be read.

A zip is believed in nothing: how many entries it has is looked at before they are listed, and the
names, sizes and kinds of all of them before anything is written.
"""

from __future__ import annotations

import os
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
_END = struct.Struct("<4s4H2LH")
"""The end record: entries and bytes of the list of contents are its fifth and sixth field."""
_LINE_BYTES = 1_000
"""Of the list of contents for each entry, at most on average."""
_LONGEST_NAME = 200
_DEEPEST = 12
_UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, struct.error)


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
        _check_end(path, bounds)
        with zipfile.ZipFile(path) as packed:
            for entry, name in _checked(packed.infolist(), bounds):
                (into / name).parent.mkdir(parents=True, exist_ok=True)
                with packed.open(entry) as source, (into / name).open("xb") as file:
                    shutil.copyfileobj(source, file)  # no more than the entry says
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


def _check_end(path: Path, bounds: ZipBounds) -> None:
    """Raise for a list of contents that is too long, before it is read."""
    with path.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - _END.size - 0xFFFF))
        tail = file.read()
    place = tail.rfind(b"PK\5\6")
    if place < 0:
        raise zipfile.BadZipFile("it has no end")
    _, _, _, _, entries, list_bytes, *_ = _END.unpack_from(tail, place)
    _check_number(max(entries, list_bytes // _LINE_BYTES), bounds)


def _check_number(entries: int, bounds: ZipBounds) -> None:
    if entries > bounds.entries:
        text = f"holds more than {bounds.entries} entries"
        raise InvalidDocument(WHAT, [("", text)])


def _checked(
    entries: list[zipfile.ZipInfo], bounds: ZipBounds
) -> list[tuple[zipfile.ZipInfo, PurePosixPath]]:
    """The files among the entries with their places."""
    _check_number(len(entries), bounds)
    total = sum(entry.file_size for entry in entries)
    if total > bounds.bytes:
        raise InvalidDocument(
            WHAT, [("", f"unpacks to {total} bytes, at most {bounds.bytes} are read")]
        )
    files: list[tuple[zipfile.ZipInfo, PurePosixPath]] = []
    taken: set[str] = set()
    for entry in entries:
        name = _place(entry)
        problem = _problem(entry)
        if problem:
            raise InvalidDocument(WHAT, [(_shown(entry.filename), problem)])
        if entry.is_dir() or _is_of_the_system(name):
            continue
        key = str(name).lower()  # some folders know no difference of case
        if key in taken:
            raise InvalidDocument(WHAT, [(_shown(entry.filename), "is there twice")])
        taken.add(key)
        files.append((entry, name))
    for entry, name in files:
        if any(str(above).lower() in taken for above in name.parents):
            raise InvalidDocument(WHAT, [(_shown(entry.filename), "lies in a file")])
    if not files:
        raise InvalidDocument(WHAT, [("", "holds no file")])
    return files


def _place(entry: zipfile.ZipInfo) -> PurePosixPath:
    """Where it is to lie, in the folder and nowhere else."""
    name = entry.filename
    place = PurePosixPath(name)
    bad = (
        not place.parts
        or "\\" in name
        or ":" in name
        or not name.isprintable()
        or place.is_absolute()
        or ".." in place.parts
        or len(place.parts) > _DEEPEST
        or any(len(os.fsencode(part)) > _LONGEST_NAME for part in place.parts)
    )
    if bad:
        text = "is no name within the folder"
        raise InvalidDocument(WHAT, [(_shown(name), text)])
    return place


def _problem(entry: zipfile.ZipInfo) -> str:
    """What keeps an entry from being unpacked, empty for nothing."""
    if entry.flag_bits & 0x1:
        return "is encrypted"
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a special file"
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return "is packed in another way than the usual one"
    return ""


def _is_of_the_system(place: PurePosixPath) -> bool:
    """What file managers add and nobody meant."""
    return "__MACOSX" in place.parts or place.name in (".DS_Store", "Thumbs.db")


def _shown(name: str) -> str:
    return repr(name[:80])
