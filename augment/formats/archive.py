"""Zips from strangers, unpacked within bounds, and what in a folder can be read.

A zip is believed in nothing: the names, sizes and kinds of all its entries are looked at before
anything is written, and while it is written the bytes are counted, whatever the zip says.
"""

from __future__ import annotations

import lzma
import os
import stat
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

from augment.errors import InvalidDocument
from augment.formats.reading import Reader

WHAT = "zip"
_PIECE = 1 << 20
_LONGEST_NAME = 200
_DEEPEST = 12
_UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, struct.error, NotImplementedError)


@dataclass(frozen=True, slots=True, kw_only=True)
class ZipBounds:
    """What a zip may hold at most.

    Attributes:
        ratio: Bytes of an entry for each packed one; small entries may have more.
    """

    entries: int = 20_000
    bytes: int = 2_000_000_000
    ratio: int = 200


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
            files = _checked(packed.infolist(), bounds)
            left = bounds.bytes
            for entry, name in files:
                left -= _write(packed, entry, into / name, most=left)
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


def _checked(
    entries: list[zipfile.ZipInfo], bounds: ZipBounds
) -> list[tuple[zipfile.ZipInfo, PurePosixPath]]:
    """The files among the entries with their places."""
    if len(entries) > bounds.entries:
        text = f"holds {len(entries)} entries, at most {bounds.entries} are read"
        raise InvalidDocument(WHAT, [("", text)])
    total = sum(entry.file_size for entry in entries)
    if total > bounds.bytes:
        raise InvalidDocument(
            WHAT, [("", f"unpacks to {total} bytes, at most {bounds.bytes} are read")]
        )
    files: list[tuple[zipfile.ZipInfo, PurePosixPath]] = []
    taken: set[str] = set()
    for entry in entries:
        name = _place(entry)
        problem = _problem(entry, bounds)
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


def _problem(entry: zipfile.ZipInfo, bounds: ZipBounds) -> str:
    """What keeps an entry from being unpacked, empty for nothing."""
    if entry.flag_bits & 0x1:
        return "is encrypted"
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a special file"
    if entry.file_size > max(bounds.ratio * entry.compress_size, _PIECE):
        return f"unpacks to more than {bounds.ratio} times its size"
    return ""


def _is_of_the_system(place: PurePosixPath) -> bool:
    """What file managers add and nobody meant."""
    return "__MACOSX" in place.parts or place.name in (".DS_Store", "Thumbs.db")


def _write(packed: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, *, most: int) -> int:
    """Write one file; how many bytes it has."""
    path.parent.mkdir(parents=True, exist_ok=True)
    written = 0
    with packed.open(entry) as source, path.open("xb") as file:
        while piece := _next_piece(source):
            written += len(piece)
            if written > min(most, entry.file_size):
                text = "unpacks to more than it says"
                raise InvalidDocument(WHAT, [(_shown(entry.filename), text)])
            file.write(piece)
    return written


def _next_piece(source: IO[bytes]) -> bytes:
    """Bytes of an entry; what its way of packing says of broken ones is said of the zip."""
    try:
        return source.read(_PIECE)
    except (OSError, lzma.LZMAError) as fault:
        raise zipfile.BadZipFile(str(fault)) from None


def _shown(name: str) -> str:
    return repr(name[:80])
