"""Recordings that came by a page: kept as files, read by workers, kept as scenes."""

from __future__ import annotations

import hashlib
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from django.conf import settings
from django.contrib.auth.models import User
from django.core.files.base import File
from django.core.files.storage import default_storage
from django.db import transaction

from augment.errors import AugmentError, Conflict, InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.opendrive.reader import OpenDrive, parse_place
from augment.formats.readers import READERS, find_reader
from augment.formats.reading import Moment, Reading
from augment.geometry.polyline import FloatArray
from augment.models import SceneUpload, SentFile, UploadMoment
from augment.render.bev import draw
from augment.render.camera import Camera, camera_for
from augment.scene.entities import Modification
from augment.services.events import log_change
from augment.services.scenarios.pictures import draw_scene, store_as
from augment.services.scenarios.scene_imports import keep_reading
from augment.services.texts import check_slug, is_readable_line
from augment.services.work import Lease, Settlement, WorkKind

State = SceneUpload.State
MomentState = UploadMoment.State
FOLDER, PREVIEWS = "uploads", "previews"
FORMATS = {reader.name: reader.title for reader in READERS.values()}
"""By name, what can be read."""
EVERY_S = 0.5
STRIP = 20
"""Moments of a recording that are drawn unasked, evenly spread over it."""
MOST_STOPS = 2_000
"""Moments that are offered; later ones of a longer recording are not."""
MOST_PLACES = 200
"""Places of a map that are drawn, each a picture."""
MAP_FORMAT = OpenDrive.name
MAP_WINDOW = Camera(x_min_m=-120.0, x_max_m=120.0, y_min_m=-90.0, y_max_m=90.0, px_per_m=5.0)
"""Of a map's picture: wide, since the ego's place is chosen on it. Its corners are 150 m away."""
LONGEST_ITEM = 200
"""Characters, as the column of a moment has them."""


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
    """Store a file for a worker to read; the entry point sends the message.

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
        find_reader(source)
    row = SceneUpload(name=plain_name(name), asked_format=source, uploaded_by=actor)
    keep_file(row, content)
    return row


def keep_file(
    row: SentFile, content: File[bytes], *, insert: Callable[[], None] | None = None
) -> None:
    """Store a file and insert its row, or neither.

    Args:
        row: New, with its name and whoever sent it.
        content: Not empty.
        insert: Inserts the row, in a transaction of its own, unless it raises.

    Raises:
        Conflict: The file is empty.
    """
    if not content.size:
        raise Conflict("The file is empty.")
    content.seek(0)
    row.size_bytes = content.size
    row.digest = hashlib.file_digest(content, "sha256").hexdigest()
    content.seek(0)
    row.stored = default_storage.save(f"{FOLDER}/{row.code}", content)
    try:
        with transaction.atomic():
            (insert or partial(row.save, force_insert=True))()
            after = {"name": row.name, "size_bytes": row.size_bytes, "digest": row.digest}
            log_change(row, "upload", row.uploaded_by, after=after)
    except BaseException:
        default_storage.delete(row.stored)
        raise


@transaction.atomic
def remove_upload(row: SceneUpload, actor: User | None = None) -> None:
    """Forget a file and what was drawn of it; scenes that were kept stay."""
    names = [row.stored, *row.moments.values_list("picture", flat=True)]
    log_change(row, "remove upload", actor, after={"name": row.name})
    row.delete()
    for name in filter(None, names):
        transaction.on_commit(partial(default_storage.delete, name))


@contextmanager
def open_file(row: SentFile) -> Iterator[Path]:
    """Copy a sent file to this machine; it is gone afterwards.

    Raises:
        Conflict: The file was removed.
    """
    if not row.stored:
        raise Conflict(f"The file of “{row.name}” was removed.")
    with tempfile.TemporaryDirectory(prefix="arena-upload-") as folder:
        path = Path(folder) / row.name
        try:
            with default_storage.open(row.stored) as source, path.open("wb") as file:
                shutil.copyfileobj(source, file)
        except FileNotFoundError:
            raise Conflict(f"The file of “{row.name}” is gone.") from None
        yield path


class Uploads(WorkKind[SceneUpload]):
    """Recordings that were sent: what each is, and what it holds."""

    model = SceneUpload

    def run(self, row: SceneUpload, held: Lease[SceneUpload]) -> Settlement:
        """List what the file offers, and draw the moment that its format means."""
        with open_file(row) as path:
            source = UntrustedInput(path=path, format=row.asked_format or None)
            name, moments = source.moments(every_s=EVERY_S, most=MOST_STOPS + 1)
            if not moments:
                raise InvalidDocument("recording", [("", "holds no moment with an ego")])
            _, reading = source.read(item=None, frame=None, name="preview")
        meant, offered = reading.moment, moments[:MOST_STOPS]
        if all((moment.item, moment.frame) != (meant.item, meant.frame) for moment in offered):
            offered.insert(0, meant)
        shown, _ = UploadMoment.objects.update_or_create(
            upload=row,
            item=meant.item or "",
            frame=meant.frame,
            defaults={"state": MomentState.DRAWN, "asked_by": row.uploaded_by},
        )
        UploadMoment.objects.filter(pk=shown.pk).update(**_preview(shown, reading))
        spread = offered[:: -(-len(offered) // STRIP)]
        UploadMoment.objects.bulk_create(
            (
                UploadMoment(
                    upload=row,
                    item=moment.item or "",
                    frame=moment.frame,
                    asked_by=row.uploaded_by,
                )
                for moment in spread
            ),
            ignore_conflicts=True,
        )
        is_cut = len(moments) > MOST_STOPS
        columns = {"format": name, "tracks": _parts(offered), "is_cut": is_cut}
        return Settlement(state=State.READ, columns=columns)


UPLOADS = Uploads()


def _parts(moments: Sequence[Moment]) -> list[dict[str, Any]]:
    """Return the moments by their items; those of one recording are one part without a name."""
    items = {moment.item for moment in moments}
    is_one = len(items) == len(moments) and all(moment.time_s is not None for moment in moments)
    parts: dict[str, list[dict[str, Any]]] = {}
    for stop_moment in moments:
        time_s = None if stop_moment.time_s is None else round(stop_moment.time_s, 2)
        stop = {"item": stop_moment.item or "", "frame": stop_moment.frame, "time_s": time_s}
        parts.setdefault("" if is_one else stop_moment.item or "", []).append(stop)
    return [{"name": name, "stops": stops} for name, stops in parts.items()]


# Moments


def ask_for_moment(
    upload: SceneUpload, item: str, frame: int, *, slug: str = "", actor: User | None = None
) -> UploadMoment:
    """Have a moment that the upload offers drawn, or kept as a scene.

    Args:
        upload: Of which.
        item: Which part of it.
        frame: Which moment of that; one that failed is drawn again.
        slug: The name of the scene, with what was recorded from there on; empty to draw alone.
        actor: Who asks.

    Raises:
        InvalidDocument: The slug can't be.
        Conflict: The upload offers no such moment, or it is kept already or being worked on.
    """
    offered = {(stop["item"], stop["frame"]) for track in upload.tracks for stop in track["stops"]}
    if (item, frame) not in offered:
        raise Conflict(f"“{upload.name}” offers no such moment.")
    if slug:
        check_slug(slug, what="scene")
    row, _ = UploadMoment.objects.get_or_create(
        upload=upload, item=item, frame=frame, defaults={"asked_by": actor}
    )
    if not slug:
        row.wait_again(state=MomentState.QUEUED)
        return row
    free = UploadMoment.objects.filter(pk=row.pk, claim=None)
    free = free.exclude(state__in=(MomentState.KEEPING, MomentState.KEPT))
    update = {"state": MomentState.KEEPING, "slug": slug, "reason": "", "sent_at": None}
    if not free.update(**update, asked_by=actor):
        raise Conflict("This moment can't be kept now: look at its state.")
    row.refresh_from_db()
    return row


@transaction.atomic
def ask_for_place(upload: SceneUpload, place: str, *, actor: User | None = None) -> UploadMoment:
    """Have a map drawn with the ego at a place that need not be offered.

    Args:
        upload: Of an OpenDRIVE map.
        place: ROAD,LANE,S; a worker says whether there is such a lane.
        actor: Who asks.

    Raises:
        InvalidDocument: It is no place.
        Conflict: The upload is no map alone, has MOST_PLACES, or no road's name has such
            characters.
    """
    # Locked, so that two places that are added at once are both kept.
    row = SceneUpload.objects.select_for_update().get(pk=upload.pk)
    if row.format != MAP_FORMAT:
        raise Conflict(f"“{row.name}” is no map alone: its ego is recorded.")
    if not is_readable_line(place.strip()):
        raise Conflict("A place has characters that print alone.")
    road, lane, s_m = parse_place(f"@{place.strip()}")
    item = f"@{road},{lane},{s_m:g}"
    if len(item) > LONGEST_ITEM:
        raise Conflict(f"That road's name is too long: at most {LONGEST_ITEM} characters.")
    if all(item != stop["item"] for track in row.tracks for stop in track["stops"]):
        if row.moments.count() >= MOST_PLACES:
            raise Conflict(f"{MOST_PLACES} places of this map are drawn already; send it anew.")
        row.tracks += _parts([Moment(item=item)])
        row.save(update_fields=["tracks"])
    return ask_for_moment(row, item, 0, actor=actor)


class Moments(WorkKind[UploadMoment]):
    """Moments of recordings: drawn, or kept as scenes."""

    model = UploadMoment
    related = ("upload", "asked_by")

    def run(self, row: UploadMoment, held: Lease[UploadMoment]) -> Settlement:
        """Draw it, or keep it; what can't be kept stays drawn."""
        is_new = row.state == MomentState.QUEUED
        try:
            with open_file(row.upload) as copied:
                file = UntrustedInput(path=copied, format=row.upload.asked_format or None)
                source, reading = file.read(
                    item=row.item or None, frame=row.frame, name="preview" if is_new else row.slug
                )
            if is_new:
                return Settlement(state=MomentState.DRAWN, columns=_preview(row, reading))
            path = Path(row.upload.name)
            scene, _ = keep_reading(reading, source=source, path=path, actor=row.asked_by)
            draw_scene(scene.pk)  # whoever keeps it looks at it next
        except AugmentError as error:
            if is_new:
                raise
            return Settlement(state=MomentState.DRAWN, reason=str(error))
        return Settlement(state=MomentState.KEPT, columns={"scene": scene})


MOMENTS = Moments()


def _preview(row: UploadMoment, reading: Reading) -> dict[str, Any]:
    """Draw a moment, and return its columns."""
    scene, recording = reading.scene, reading.recording
    picture = f"{PREVIEWS}/{row.code}.png"
    camera = MAP_WINDOW if reading.places else camera_for(scene, None)
    store_as(picture, draw(scene, Modification(), camera))
    report = {name: len(getattr(scene, name)) for name in _COUNTED} | {
        "recorded_s": 0.0 if recording is None else round(float(recording.times_s[-1]), 1),
        "provenance": scene.provenance,
        "notes": reading.notes,
    }
    if reading.places:
        report["places"] = {
            lane: _list_shown(np.array(rows), camera)
            for lane, rows in reading.places.items()
            if rows
        }
    return {"picture": picture, "report": report}


def _list_shown(places: FloatArray, camera: Camera) -> list[list[float]]:
    """Return s_m and the pixels x, y of the places (N, 3: s, x, y in metres) in a picture."""
    pixels = camera.to_pixels(places[:, 1:]).round()
    inside = ((pixels >= 0.0) & (pixels <= (camera.width_px, camera.height_px))).all(axis=1)
    rows: list[list[float]] = np.column_stack([places[:, 0], pixels])[inside].tolist()
    return rows


_COUNTED = ("agents", "lanes", "connectors", "areas")
