"""Who reads an upload or one of its moments: a worker that says so, again and again.

A message may come twice or never, and a large file takes long. So the worker marks the row as long
as it reads; nobody else begins a row with a fresh mark, and one whose mark grew old is sent again.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TypeVar

from django.conf import settings
from django.db import Error, connection
from django.db.models import F, Q

from augment.models import SceneUpload, UploadMoment
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.repeating import repeating

logger = logging.getLogger(__name__)

LOST_AFTER = timedelta(minutes=10)
"""A row that nobody began by then may have lost its message."""

Row = TypeVar("Row", SceneUpload, UploadMoment)


def is_silent(now: Moment = DATABASE_TIME) -> Q:
    """Which rows no worker is heard from."""
    return Q(heartbeat_at=None) | _went_silent(now)


def lost_since(now: Moment) -> Q:
    """Which waiting rows nobody works on: their worker ended, or no message reached one."""
    long_ago = now - LOST_AFTER
    is_old = Q(sent_at__lt=long_ago) | Q(sent_at=None, created_at__lt=long_ago)
    # A newer message than the last beat may still wait in the queue.
    is_unsent_since = Q(sent_at=None) | Q(sent_at__lt=F("heartbeat_at"))
    return (is_silent(now) & is_old) | (_went_silent(now) & is_unsent_since)


@contextmanager
def heartbeat(row: Row) -> Iterator[None]:
    """Keep the mark of a begun row fresh until the block is left, then take it off.

    A worker that is told to stop leaves the row without a mark, so that the next one begins it.
    """
    mine = type(row)._default_manager.filter(pk=row.pk, state=row.state, attempts=row.attempts)

    def beat() -> bool:
        try:
            return bool(mine.exclude(heartbeat_at=None).update(heartbeat_at=DATABASE_TIME))
        except Error as error:
            logger.warning("No heartbeat for upload %s: %s", row.code, error)
            connection.close()
            return True

    try:
        with repeating(beat, every_s=settings.HEARTBEAT_S, name="upload heartbeat"):
            yield
    finally:
        mine.update(heartbeat_at=None)


def _went_silent(now: Moment) -> Q:
    return Q(heartbeat_at__lt=now - timedelta(seconds=settings.STALE_AFTER_S))
