"""Whether this process was told to stop: then nothing new is begun, and nobody is asked again."""

from __future__ import annotations

from threading import Event

from augment.errors import WorkerStopping

_told = Event()


def request_stop() -> None:
    """Let nothing new begin; safe to call from a signal handler."""
    _told.set()


def withdraw_stop() -> None:
    """As at the start of a process."""
    _told.clear()


def is_stop_requested() -> bool:
    """Whether this process is to stop."""
    return _told.is_set()


def wait(seconds: float) -> None:
    """Until so many seconds have passed or the process is to stop."""
    _told.wait(seconds)


def insist_on_going_on() -> None:
    """Return while there is no reason to stop.

    Raises:
        WorkerStopping: The process was told to.
    """
    if is_stop_requested():
        raise WorkerStopping("this worker was told to stop")
