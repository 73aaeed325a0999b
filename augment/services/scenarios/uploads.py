"""Recordings that came by a page: kept as files, read by workers, kept as scenes."""

from __future__ import annotations

import hashlib
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.core.files.base import File
from django.core.files.storage import default_storage
from django.db import transaction

from augment.errors import AugmentError, Conflict, InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.readers import READERS, RecordingPart, reader_of
from augment.formats.reading import Reading
from augment.models import SceneUpload, UploadMoment
from augment.render.bev import draw
from augment.render.camera import camera_for
from augment.scene.entities import Modification
from augment.scene.recording import notes_from_document, notes_to_document
from augment.services.events import log_change
from augment.services.scenarios.pictures import store_as
from augment.services.scenarios.scene_imports import keep_reading, sentence_of
from augment.services.scenarios.scenes import check_slug
from augment.services.work import Lease, Settlement, WorkKind

State = SceneUpload.State
MomentState = UploadMoment.State
FOLDER, PREVIEWS = "uploads", "previews"
FORMATS = {reader.name: reader.title for reader in READERS.values()}
"""By name, what can be read."""


def most_megabytes() -> int:
    """Return how large a file may be."""
    return int(settings.UPLOAD_MB)


def plain_name(name: str) -> str:
    """Return a file's name without folders, in letters that every system takes."""
    last = re.split(r"[/\\]", name)[-1]
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", last).strip(".-") or "file"
    return plain if len(plain) <= 100 else plain[:60] + plain[-40:]


# Files


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
    if not content.size:
        raise Conflict("The file is empty.")
    content.seek(0)
    row = SceneUpload(
        name=plain_name(name),
        size_bytes=content.size,
        digest=hashlib.file_digest(content, "sha256").hexdigest(),
        asked_format=source,
        uploaded_by=actor,
    )
    content.seek(0)
    row.stored = default_storage.save(f"{FOLDER}/{row.code}", content)
    try:
        with transaction.atomic():
            row.save(force_insert=True)
            after = {"name": row.name, "size_bytes": row.size_bytes, "digest": row.digest}
            log_change(row, "upload", actor, after=after)
    except BaseException:
        default_storage.delete(row.stored)
        raise
    return row


@transaction.atomic
def remove_upload(row: SceneUpload, actor: User | None = None) -> None:
    """Forget a file and what was drawn of it; scenes that were kept stay."""
    names = [row.stored, *row.moments.values_list("picture", flat=True)]
    log_change(row, "remove upload", actor, after={"name": row.name})
    row.delete()
    for name in filter(None, names):
        transaction.on_commit(partial(default_storage.delete, name))


@contextmanager
def open_upload(row: SceneUpload) -> Iterator[UntrustedInput]:
    """Open the file on this machine; it is gone afterwards.

    Raises:
        Conflict: The file was removed.
    """
    with tempfile.TemporaryDirectory(prefix="arena-upload-") as folder:
        path = Path(folder) / row.name
        try:
            with default_storage.open(row.stored) as source, path.open("wb") as file:
                shutil.copyfileobj(source, file)
        except FileNotFoundError:
            raise Conflict(f"The file of “{row.name}” is gone.") from None
        yield UntrustedInput(path=path, format=row.asked_format or None)


class Uploads(WorkKind[SceneUpload]):
    """Recordings that were sent: what each is, and what it holds."""

    model = SceneUpload

    def run(self, row: SceneUpload, held: Lease[SceneUpload]) -> Settlement:
        """Look into the file."""
        with open_upload(row) as source:
            name, found = source.look()
        if not any(track.stops for track in found.tracks):
            raise InvalidDocument("recording", [("", "holds no moment with an ego")])
        tracks = [_document(track) for track in found.tracks]
        columns = {"format": name, "tracks": tracks, "is_cut": found.is_cut}
        return Settlement(state=State.READ, columns=columns)


UPLOADS = Uploads()


def _document(track: RecordingPart) -> dict[str, Any]:
    stops = [
        {
            "item": stop.moment.item or "",
            "frame": stop.moment.frame,
            "time_s": None if stop.moment.time_s is None else round(stop.moment.time_s, 2),
            "place_m": stop.place_m and [round(value, 2) for value in stop.place_m],
        }
        for stop in track.stops
    ]
    seen = {"name": track.name, "is_seen": track.is_seen, "roads_m": track.roads_m}
    return seen | {"stops": stops}


# Moments


def ask_for_moment(
    upload: SceneUpload, *, item: str, frame: int, actor: User | None = None
) -> UploadMoment:
    """Return the row of a moment that the upload offers; one that failed waits again.

    Raises:
        Conflict: The upload offers no such moment.
    """
    offered = {(stop["item"], stop["frame"]) for track in upload.tracks for stop in track["stops"]}
    if (item, frame) not in offered:
        raise Conflict(f"“{upload.name}” offers no such moment.")
    row, _ = UploadMoment.objects.get_or_create(
        upload=upload, item=item, frame=frame, defaults={"asked_by": actor}
    )
    row.wait_again(state=MomentState.QUEUED)
    return row


@transaction.atomic
def ask_to_keep(row: UploadMoment, *, slug: str, actor: User | None = None) -> None:
    """Have a drawn moment kept as a scene, with what was recorded from there on.

    Raises:
        InvalidDocument: The slug can't be.
        Conflict: The moment is not drawn, or kept already.
    """
    check_slug(slug, what="scene")
    drawn = UploadMoment.objects.filter(pk=row.pk, state=MomentState.DRAWN)
    asked = {"state": MomentState.KEEPING, "slug": slug, "reason": "", "sent_at": None}
    if not drawn.update(**asked, asked_by=actor):
        raise Conflict("This moment can't be kept now: look at its state.")


class Moments(WorkKind[UploadMoment]):
    """Moments of recordings: drawn, or kept as scenes."""

    model = UploadMoment
    related = ("upload", "asked_by")

    def run(self, row: UploadMoment, held: Lease[UploadMoment]) -> Settlement:
        """Draw it, or keep it; what can't be kept stays drawn."""
        is_new = row.state == MomentState.QUEUED
        try:
            with open_upload(row.upload) as file:
                source, reading = file.read(
                    item=row.item or None, frame=row.frame, name="preview" if is_new else row.slug
                )
            if is_new:
                picture = f"{PREVIEWS}/{row.code}.png"
                scene = reading.scene
                store_as(picture, draw(scene, Modification(), camera_for(scene, None)))
                columns = {"picture": picture, "report": _report(reading)}
                return Settlement(state=MomentState.DRAWN, columns=columns)
            path = Path(row.upload.name)
            kept, _ = keep_reading(reading, source=source, path=path, actor=row.asked_by)
        except AugmentError as error:
            if is_new:
                raise
            return Settlement(state=MomentState.DRAWN, reason=str(error))
        return Settlement(state=MomentState.KEPT, columns={"scene": kept})


MOMENTS = Moments()


def sentences_of(row: UploadMoment) -> list[str]:
    """Return what the source left open at this moment."""
    return [sentence_of(note) for note in notes_from_document((row.report or {}).get("notes", []))]


def _report(reading: Reading) -> dict[str, Any]:
    scene, recording = reading.scene, reading.recording
    counts = {name: len(getattr(scene, name)) for name in _COUNTED}
    return counts | {
        "recorded_s": 0.0 if recording is None else round(float(recording.times_s[-1]), 1),
        "provenance": scene.provenance,
        "notes": notes_to_document(reading.notes),
    }


_COUNTED = ("agents", "lanes", "connectors", "areas")
