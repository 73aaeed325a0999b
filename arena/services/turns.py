"""Writers of SQLite one after the other, in the order in which they came."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from django.db import connection

SUFFIX = "-turn"
"""What the file that writers queue at adds to the database's name."""


@contextmanager
def in_turn() -> Iterator[None]:
    """Wait for a turn to write; nothing to wait for where the database queues writers itself.

    Who finds SQLite locked sleeps for up to 100 ms, looks again and may be overtaken by any number
    of others: with eight voters one vote in twenty took five times as long as the median. The
    system wakes who waits for a file lock at once. Writers that come another way still meet
    SQLite's own lock.
    """
    if connection.vendor != "sqlite" or connection.in_atomic_block:
        yield  # who holds SQLite's lock already must not wait for somebody who waits for it
        return
    path = Path(str(connection.settings_dict["NAME"]) + SUFFIX)
    with open(path, "ab", opener=_private) as turn:  # closed, it is free again, whatever happens
        fcntl.flock(turn, fcntl.LOCK_EX)
        yield


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)
