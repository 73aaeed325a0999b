"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


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
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.writelines(pieces)
            file.flush()
            os.fsync(file.fileno())
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)
