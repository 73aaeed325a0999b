"""Files and folders that only their owner reads: votes, sessions and keys are nobody else's."""

import os
import stat
from contextlib import suppress
from pathlib import Path

FOLDER, FILE = 0o700, 0o600

BESIDE = ("", "-wal", "-shm", "-journal", "-turn")
"""What stands beside an SQLite file, by what it adds to the name."""


def make_folder(folder: Path) -> None:
    """Make a folder and what is missing above it, for its owner alone; one that is there stays.

    Raises:
        OSError: It can't be made.
    """
    for missing in reversed([place for place in (folder, *folder.parents) if not place.exists()]):
        missing.mkdir(mode=FOLDER, exist_ok=True)


def mend_folder(folder: Path, *, around: Path) -> None:
    """Close a folder of ours to others, where it stood open.

    One that is not ours alone stays as it is: one for everybody (/tmp), or one with the program
    itself (`around`) in it.
    """
    if not folder.is_dir() or around.is_relative_to(folder):
        return
    if not folder.stat().st_mode & stat.S_ISVTX:
        _close(folder)


def mend_file(path: Path) -> None:
    """Close a file to others, where there is one and it stood open."""
    if path.is_file():
        _close(path)


def make_database(path: Path) -> None:
    """See that an SQLite file and what stands beside it are their owner's alone.

    SQLite would make the file for everybody to read; what it makes beside it later has the same
    mode as the file.

    Raises:
        OSError: It can't be made.
    """
    os.close(os.open(path, os.O_RDONLY | os.O_CREAT, FILE))
    for beside in BESIDE:
        mend_file(path.with_name(path.name + beside))


def _close(path: Path) -> None:
    mode = stat.S_IMODE(path.stat().st_mode)
    if mode & 0o077:
        # Somebody else's, or on a disk without modes: whoever set that up decides.
        with suppress(OSError):
            path.chmod(mode & ~0o077)
