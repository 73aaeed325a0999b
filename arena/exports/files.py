"""Files that are there whole or not at all."""

import hashlib
import io
import os
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from arena.errors import ArenaError


def write_whole(path: Path, content: bytes, *, mode: int = 0o644) -> None:
    """Write beside the place and rename: a reader never sees half a file.

    Args:
        path: Where it is to be.
        content: All of it.
        mode: Who may read and write it.

    Raises:
        OSError: The folder does not exist or can't be written to; the old file stays.
    """
    write_pieces(path, [content], mode=mode)


def write_pieces(path: Path, pieces: Iterable[bytes], *, mode: int = 0o644) -> None:
    """The same for what is too large to be held at once.

    Raises:
        OSError: The folder does not exist or can't be written to; the old file stays.
    """
    with _beside(path, pieces) as written:
        written.chmod(mode)
        written.replace(path)


def write_once(path: Path, content: bytes) -> None:
    """Write a file that only its owner reads, unless it is there: the first of several wins.

    Raises:
        OSError: The folder does not exist or can't be written to.
    """
    with _beside(path, [content]) as written, suppress(FileExistsError):
        os.link(written, path)


@contextmanager
def _beside(path: Path, pieces: Iterable[bytes]) -> Iterator[Path]:
    """A file of these pieces in the folder of path, for its owner only; gone afterwards."""
    name = ""
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "wb") as file:
            file.writelines(pieces)
            file.flush()
            os.fsync(file.fileno())
        yield Path(name)
    except OSError as error:  # a full disk has no name, and the file on its way another
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        if name:
            Path(name).unlink(missing_ok=True)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield a folder to fill, which then stands at the path: whole, or not at all.

    Raises:
        ArenaError: Something is there.
        OSError: It can't be written; nothing is left of it.
    """
    if path.exists():
        raise ArenaError(f"{path} is there already; an export overwrites nothing.")
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as scratch:
        beside = Path(scratch, path.name)
        beside.mkdir()
        yield beside
        beside.rename(path)


CONTENT_TYPE = "application/zip"

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can name: what is in it says when it was made."""

_READABLE = 0o100644 << 16
_UNIX = 3


def zip_folder(folder: Path, packed: IO[bytes]) -> None:
    """Write a zip of a folder's files into an open one, one file after the other."""
    with zipfile.ZipFile(packed, "w") as archive:
        for path in sorted(entry for entry in folder.rglob("*") if entry.is_file()):
            archive.writestr(_entry(path.relative_to(folder).as_posix()), path.read_bytes())


def zip_bytes(files: Mapping[str, bytes]) -> bytes:
    """The files in one zip, by name."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name in sorted(files):
            archive.writestr(_entry(name), files[name])
    return packed.getvalue()


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, date_time=_EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = _READABLE
    entry.create_system = _UNIX
    return entry


def sha256_hex(content: bytes) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def describe_files(files: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the hash and the size of each file, for a manifest."""
    return {
        name: {"sha256": sha256_hex(content), "bytes": len(content)}
        for name, content in files.items()
    }


WARNING = "WARNING.txt"
