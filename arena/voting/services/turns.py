"""Writers of SQLite one after the other, in the order in which they came, and not for ever."""

import fcntl
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from django.db import OperationalError, connection
from django.db.backends.base.base import BaseDatabaseWrapper

from arena.errors import DatabaseBusy
from augment.services import is_passing

SUFFIX = "-turn"
"""What the file that writers queue at adds to the database's name."""

LOOK_EVERY_S = 0.001
"""How often a thread looks whether another process has left; one thread a process does."""


@contextmanager
def in_turn(*, within_s: float | None = None) -> Iterator[None]:
    """Wait for a turn to write; nothing to queue for where the database queues writers itself.

    Who finds SQLite locked sleeps for up to 100 ms, looks again and may be overtaken by any number
    of others: with eight voters one vote in twenty took five times as long as the median. Who
    waits here is woken at once. Writers that come another way still meet SQLite's own lock.

    Args:
        within_s: How long to wait at most for the turn and the database's locks together; None
            for as long as it takes.

    Raises:
        DatabaseBusy: It took longer, or the disk is full; nothing was written.
    """
    if connection.in_atomic_block:
        yield  # who holds SQLite's lock already must not wait for somebody who waits for it
        return
    limit = None if within_s is None else time.monotonic() + within_s
    try:
        if connection.vendor == "sqlite":
            with _turn(limit), _patience_until(limit):
                yield
        else:
            yield  # web servers limit the waiting of their connections: arena.config.wsgi
    except OperationalError as error:
        if limit is not None and is_passing(error):
            raise DatabaseBusy from error
        raise


def limit_waiting(connection: BaseDatabaseWrapper, within_s: float) -> None:
    """Have all that a connection does wait for a lock no longer than that."""
    with connection.cursor() as cursor:
        if connection.vendor == "sqlite":
            cursor.execute(f"PRAGMA busy_timeout = {_ms(within_s)}")
        else:
            cursor.execute(f"SET lock_timeout = {max(1, _ms(within_s))}")  # 0 is no limit


# --- Private -----------------------------------------------------------------------------------


_DOOR = threading.Lock()


@contextmanager
def _turn(limit: float | None) -> Iterator[None]:
    """Keep out the other threads, which are woken at once, and then the other processes."""
    if not _DOOR.acquire(timeout=-1 if limit is None else max(0.0, limit - time.monotonic())):
        raise DatabaseBusy
    try:
        path = Path(str(connection.settings_dict["NAME"]) + SUFFIX)
        path.touch(mode=0o600)
        with path.open("ab") as turn:  # closed, it is free again
            if limit is None:
                fcntl.flock(turn, fcntl.LOCK_EX)
            while limit is not None and not _is_locked(turn):
                if time.monotonic() >= limit:
                    raise DatabaseBusy
                time.sleep(LOOK_EVERY_S)
            yield
    finally:
        _DOOR.release()


def _is_locked(turn: IO[bytes]) -> bool:
    try:
        fcntl.flock(turn, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def _patience_until(limit: float | None) -> Iterator[None]:
    """Give the remaining time to SQLite's own lock, then restore its timeout."""
    if limit is None:
        yield
        return
    with connection.cursor() as cursor:
        cursor.execute("PRAGMA busy_timeout")
        (before_ms,) = cursor.fetchone()
    limit_waiting(connection, limit - time.monotonic())
    try:
        yield
    finally:
        limit_waiting(connection, before_ms / 1000)


def _ms(seconds: float) -> int:
    return max(0, round(seconds * 1000))
