"""Moments of an uploaded recording: drawn for whoever chooses one, and kept as scenes."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import F

from augment.errors import AugmentError, Conflict
from augment.formats.reading import Reading
from augment.models import SceneUpload, UploadMoment
from augment.render.bev import draw
from augment.render.camera import camera_for
from augment.scene.modification import Modification
from augment.scene.notes import notes_from_document, notes_to_document
from augment.sentences import Sentence, sentence
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.scenarios.pictures import store_as
from augment.services.scenarios.scene_imports import keep_reading
from augment.services.scenarios.scene_notes import said_of
from augment.services.scenarios.scenes import check_slug
from augment.services.scenarios.upload_heartbeat import heartbeat, is_silent, lost_since
from augment.services.scenarios.uploads import (
    LONGEST_REASON,
    MOST_ATTEMPTS,
    OUR_FAULT,
    open_upload,
)
from augment.services.texts import make_storable

logger = logging.getLogger(__name__)

State = UploadMoment.State
PREVIEWS = "previews"


def ask_for_moment(
    upload: SceneUpload, *, item: str, frame: int, actor: User | None = None
) -> tuple[UploadMoment, bool]:
    """The row of a moment that the upload offers, and whether a worker has still to draw it.

    Raises:
        Conflict: The upload offers no such moment.
    """
    offered = {(stop["item"], stop["frame"]) for track in upload.tracks for stop in track["stops"]}
    if (item, frame) not in offered:
        raise Conflict(
            sentence("“%(name)s” offers no such moment.", name=upload.name),
        )
    row, is_new = UploadMoment.objects.get_or_create(
        upload=upload, item=item, frame=frame, defaults={"asked_by": actor}
    )
    if row.state == State.FAILED:
        UploadMoment.objects.filter(pk=row.pk, state=State.FAILED).update(
            state=State.QUEUED, reason="", attempts=0, sent_at=None
        )
        row.refresh_from_db()
        is_new = True
    return row, is_new


@transaction.atomic
def ask_to_keep(row: UploadMoment, *, slug: str, actor: User | None = None) -> None:
    """Have a drawn moment kept as a scene, with what was recorded from there on.

    Raises:
        InvalidDocument: The slug can't be.
        Conflict: The moment is not drawn, or kept already.
    """
    check_slug(slug, what="scene")
    drawn = UploadMoment.objects.filter(pk=row.pk, state=State.DRAWN)
    asked = drawn.update(
        state=State.KEEPING, slug=slug, reason="", attempts=0, asked_by=actor, sent_at=None
    )
    if not asked:
        raise Conflict(sentence("This moment can't be kept now: look at its state."))


def work_on_moment(moment_pk: int) -> None:
    """What a worker does: draw a moment, or keep it; a second time nothing is left to do."""
    row = _begin(moment_pk)
    if row is None:
        return
    with heartbeat(row):
        _draw_or_keep(row)


def sentences_of(row: UploadMoment) -> list[Sentence]:
    """What the source left open at this moment."""
    return [said_of(note) for note in notes_from_document((row.report or {}).get("notes", []))]


def find_lost(*, now: Moment = DATABASE_TIME) -> list[int]:
    """Moments whose message never came, or whose worker ended over them."""
    lost = UploadMoment.objects.filter(lost_since(now), state__in=UploadMoment.WAITING)
    return list(lost.values_list("pk", flat=True))


def mark_sent(moment_pk: int, *, now: Moment = DATABASE_TIME) -> None:
    """Remember when the message of a moment was sent."""
    UploadMoment.objects.filter(pk=moment_pk).update(sent_at=now)


# --- Private -----------------------------------------------------------------------------------


def _begin(moment_pk: int) -> UploadMoment | None:
    waiting = UploadMoment.objects.filter(pk=moment_pk, state__in=UploadMoment.WAITING)
    begun = {"attempts": F("attempts") + 1, "heartbeat_at": DATABASE_TIME}
    if not waiting.filter(is_silent()).update(**begun):
        return None
    row = UploadMoment.objects.select_related("upload", "asked_by").get(pk=moment_pk)
    if row.attempts > MOST_ATTEMPTS:
        _end(row, state=State.FAILED, reason=f"{MOST_ATTEMPTS} workers ended while reading it.")
        return None
    return row


def _draw_or_keep(row: UploadMoment) -> None:
    wants_scene = row.state == State.KEEPING
    try:
        name = row.slug if wants_scene else "preview"
        with open_upload(row.upload) as file:
            source, reading = file.read(item=row.item or None, frame=row.frame, name=name)
        if wants_scene:
            path = Path(row.upload.name)
            scene, _ = keep_reading(reading, source=source, path=path, actor=row.asked_by)
            _end(row, state=State.KEPT, scene=scene)
            return
        picture = f"{PREVIEWS}/{row.code}.png"
        camera = camera_for(reading.scene, None)
        store_as(picture, draw(reading.scene, Modification(), camera))
        _end(row, state=State.DRAWN, picture=picture, report=_report(reading))
    except AugmentError as error:
        reason = make_storable(str(error))[:LONGEST_REASON]
        _end(row, state=State.DRAWN if wants_scene else State.FAILED, reason=reason)
    except Exception:
        logger.exception("A moment of upload %s could not be read", row.upload.code)
        _end(row, state=State.FAILED, reason=OUR_FAULT)


def _end(row: UploadMoment, **columns: Any) -> None:
    UploadMoment.objects.filter(pk=row.pk, state=row.state).update(heartbeat_at=None, **columns)


def _report(reading: Reading) -> dict[str, Any]:
    scene, recording = reading.scene, reading.recording
    return {
        "agents": len(scene.agents),
        "lanes": len(scene.lanes),
        "connectors": len(scene.connectors),
        "areas": len(scene.areas),
        "recorded_s": 0.0 if recording is None else round(float(recording.times_s[-1]), 1),
        "provenance": scene.provenance,
        "notes": notes_to_document(reading.notes),
    }
