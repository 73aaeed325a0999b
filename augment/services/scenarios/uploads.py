"""Recordings that came by a page: kept as files, read by workers, kept as scenes.

A worker that ends over a file leaves its row under way, and is not heard from any more; the row is
begun again, and given up once `MOST_ATTEMPTS` workers ended over it, so that no file can kill one
worker after the other.
"""

from __future__ import annotations

import hashlib
import logging
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.core.files.base import File
from django.core.files.storage import default_storage
from django.db import transaction
from django.db.models import F
from django.utils import timezone

from augment.errors import AugmentError, Conflict, InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.readers import READERS, reader_of
from augment.formats.timeline import RecordingPart, Timeline
from augment.models import SceneUpload
from augment.sentences import sentence
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.events import log_event
from augment.services.scenarios.upload_heartbeat import heartbeat, is_silent, lost_since
from augment.services.texts import make_storable

logger = logging.getLogger(__name__)

State = SceneUpload.State

FOLDER = "uploads"
MOST_ATTEMPTS = 2
LONGEST_REASON = 2_000
OUR_FAULT = "The program itself failed on this file; the worker's log says more."

FORMATS = {reader.name: reader.title for reader in READERS.values()}
"""By name, what can be read."""


def most_megabytes() -> int:
    """How large a file may be."""
    return int(settings.UPLOAD_MB)


def keep_upload(
    *, name: str, content: File[bytes], source: str = "", actor: User | None = None
) -> SceneUpload:
    """Store a file for a worker to read; the door sends the message.

    Args:
        name: As the sender called it; kept in plain letters.
        content: The file, not empty.
        source: The name of a format, empty to recognise it.
        actor: Who sent it.

    Raises:
        UnknownName: No such format.
        Conflict: The file is empty.
    """
    if source:
        reader_of(source)
    digest, size = hashlib.sha256(), 0
    content.seek(0)
    for piece in content.chunks():
        digest.update(piece)
        size += len(piece)
    if not size:
        raise Conflict(sentence("The file is empty."))
    row = SceneUpload(
        name=plain_name(name),
        size_bytes=size,
        digest=digest.hexdigest(),
        asked_format=source,
        uploaded_by=actor,
    )
    content.seek(0)
    row.stored = default_storage.save(f"{FOLDER}/{row.code}", content)
    try:
        with transaction.atomic():
            row.save(force_insert=True)
            _log(row, "upload", actor, size_bytes=size, digest=row.digest)
    except BaseException:
        default_storage.delete(row.stored)
        raise
    return row


@transaction.atomic
def remove_upload(row: SceneUpload, actor: User | None = None) -> None:
    """Forget a file and what was drawn of it; scenes that were kept stay."""
    names = [row.stored, *row.moments.values_list("picture", flat=True)]
    _log(row, "remove upload", actor)
    row.delete()
    for name in filter(None, names):
        transaction.on_commit(lambda name=name: default_storage.delete(name))  # type: ignore[misc]


@transaction.atomic
def read_again(row: SceneUpload) -> None:
    """Let a failed upload wait once more.

    Raises:
        Conflict: It did not fail.
    """
    again = SceneUpload.objects.filter(pk=row.pk, state=State.FAILED)
    if not again.update(state=State.QUEUED, reason="", attempts=0, sent_at=None):
        raise Conflict(sentence("“%(name)s” did not fail.", name=row.name))


def read_upload(upload_pk: int) -> None:
    """What a worker does: find out what a file is and holds; a second time nothing is left."""
    row = _begin(upload_pk)
    if row is None:
        return
    with heartbeat(row):
        _find_out(row)


@contextmanager
def open_upload(row: SceneUpload) -> Iterator[UntrustedInput]:
    """The file on this machine; gone afterwards.

    Raises:
        Conflict: The file was removed.
    """
    with tempfile.TemporaryDirectory(prefix="arena-upload-") as folder:
        path = Path(folder) / row.name
        try:
            with default_storage.open(row.stored) as source, path.open("wb") as file:
                shutil.copyfileobj(source, file)
        except FileNotFoundError:
            raise Conflict(sentence("The file of “%(name)s” is gone.", name=row.name)) from None
        yield UntrustedInput(path=path, format=row.asked_format or None)


def plain_name(name: str) -> str:
    """A file's name without folders, in letters that every system takes."""
    last = re.split(r"[/\\]", name)[-1]
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", last).strip(".-") or "file"
    return plain if len(plain) <= 100 else plain[:60] + plain[-40:]


def find_lost(*, now: Moment = DATABASE_TIME) -> list[int]:
    """Uploads whose message never came, or whose worker ended over them."""
    lost = SceneUpload.objects.filter(lost_since(now), state__in=SceneUpload.WAITING)
    return list(lost.values_list("pk", flat=True))


def mark_sent(upload_pk: int, *, now: Moment = DATABASE_TIME) -> None:
    """Remember when the message of an upload was sent."""
    SceneUpload.objects.filter(pk=upload_pk).update(sent_at=now)


# --- Private -----------------------------------------------------------------------------------


def _begin(upload_pk: int) -> SceneUpload | None:
    waiting = SceneUpload.objects.filter(pk=upload_pk, state__in=SceneUpload.WAITING)
    begun = {"state": State.RUNNING, "attempts": F("attempts") + 1, "heartbeat_at": DATABASE_TIME}
    if not waiting.filter(is_silent()).update(**begun):
        return None
    row = SceneUpload.objects.get(pk=upload_pk)
    if row.attempts > MOST_ATTEMPTS:
        _end(row, state=State.FAILED, reason=f"{MOST_ATTEMPTS} workers ended while reading it.")
        return None
    return row


def _find_out(row: SceneUpload) -> None:
    try:
        with open_upload(row) as source:
            name, timeline = source.look()
        _end(row, state=State.READ, reason="", format=name, **_columns(timeline))
    except AugmentError as error:
        _end(row, state=State.FAILED, reason=make_storable(str(error))[:LONGEST_REASON])
    except Exception:
        logger.exception("Upload %s could not be read", row.code)
        _end(row, state=State.FAILED, reason=OUR_FAULT)


def _end(row: SceneUpload, **columns: Any) -> None:
    running = SceneUpload.objects.filter(pk=row.pk, state=State.RUNNING)
    running.update(finished_at=timezone.now(), heartbeat_at=None, **columns)


def _columns(found: Timeline) -> dict[str, Any]:
    if not any(track.stops for track in found.tracks):
        raise InvalidDocument("recording", [("", "holds no moment with an ego")])
    return {"tracks": [_document(track) for track in found.tracks], "is_cut": found.is_cut}


def _document(track: RecordingPart) -> dict[str, Any]:
    return {
        "name": track.name,
        "is_seen": track.is_seen,
        "stops": [
            {
                "item": stop.moment.item or "",
                "frame": stop.moment.frame,
                "time_s": None if stop.moment.time_s is None else round(stop.moment.time_s, 2),
                "place_m": None
                if stop.place_m is None
                else [round(value, 2) for value in stop.place_m],
            }
            for stop in track.stops
        ],
        "roads_m": track.roads_m,
    }


def _log(row: SceneUpload, verb: str, actor: User | None, **after: Any) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="upload",
        object_code=row.code,
        after={"name": row.name, **after},
    )
