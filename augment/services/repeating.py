"""A sign of life beside long work: a thread that beats until the work ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from django.db import connection


@contextmanager
def repeating(beat: Callable[[], bool], *, every_s: float, name: str) -> Iterator[None]:
    """Beat every so many seconds until the block is left, or until a beat says False.

    The thread has a database connection of its own, which is closed with it.
    """
    stop = Event()
    thread = Thread(target=_beat_until, args=(beat, every_s, stop), name=name, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def _beat_until(beat: Callable[[], bool], every_s: float, stop: Event) -> None:
    """Wait, then beat, until told to stop."""
    try:
        while not stop.wait(every_s):
            if not beat():
                return
    finally:
        connection.close()
