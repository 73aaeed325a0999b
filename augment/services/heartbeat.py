"""The sign of life of a worker, given by a thread of its own while the worker is busy."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

from django.db import Error, connection
from django.utils import timezone

from augment.services import claims

logger = logging.getLogger(__name__)


@contextmanager
def heartbeat(held: claims.Claim, *, every_s: float) -> Iterator[None]:
    """Beat for the claim until the block is left, or until the claim is lost.

    The thread has a database connection of its own, which is closed with it.
    """
    stop = Event()
    thread = Thread(target=_beat_until, args=(held, every_s, stop), name="heartbeat", daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def _beat_until(held: claims.Claim, every_s: float, stop: Event) -> None:
    """Beat, then wait, until told to stop."""
    try:
        while not stop.wait(every_s):
            if not _beat(held):
                logger.warning("Augmentation %d is somebody else's now.", held.augmentation_pk)
                return
    finally:
        connection.close()


def _beat(held: claims.Claim) -> bool:
    """One beat; a database that can't take it now gets the next one."""
    try:
        return claims.beat(held=held, now=timezone.now())
    except Error as error:
        logger.warning("No heartbeat for augmentation %d: %s", held.augmentation_pk, error)
        connection.close()
        return True
