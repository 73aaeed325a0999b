"""Moments of an uploaded recording: drawn for whoever chooses one, and kept as scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import AugmentError, Conflict
from augment.formats.reading import Reading
from augment.models import SceneUpload, UploadMoment
from augment.render.bev import draw
from augment.render.camera import camera_for
from augment.scene.entities import Modification
from augment.scene.recording import notes_from_document, notes_to_document
from augment.services.scenarios.pictures import store_as
from augment.services.scenarios.scene_imports import keep_reading, said_of
from augment.services.scenarios.scenes import check_slug
from augment.services.scenarios.uploads import open_upload
from augment.services.work import Lease, Settlement, WorkKind

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
        raise Conflict(f"“{upload.name}” offers no such moment.")
    row, is_new = UploadMoment.objects.get_or_create(
        upload=upload, item=item, frame=frame, defaults={"asked_by": actor}
    )
    return row, row.wait_again(state=State.QUEUED) or is_new


@transaction.atomic
def ask_to_keep(row: UploadMoment, *, slug: str, actor: User | None = None) -> None:
    """Have a drawn moment kept as a scene, with what was recorded from there on.

    Raises:
        InvalidDocument: The slug can't be.
        Conflict: The moment is not drawn, or kept already.
    """
    check_slug(slug, what="scene")
    drawn = UploadMoment.objects.filter(pk=row.pk, state=State.DRAWN)
    asked = drawn.update(state=State.KEEPING, slug=slug, reason="", asked_by=actor, sent_at=None)
    if not asked:
        raise Conflict("This moment can't be kept now: look at its state.")


class Moments(WorkKind[UploadMoment]):
    """Moments of recordings: drawn, or kept as scenes."""

    model = UploadMoment
    related = ("upload", "asked_by")

    def run(self, row: UploadMoment, held: Lease[UploadMoment]) -> Settlement:
        """Draw it, or keep it; what can't be kept stays drawn."""
        if row.state == State.QUEUED:
            return _drawn(row)
        try:
            return _kept(row)
        except AugmentError as error:
            return Settlement(state=State.DRAWN, reason=str(error))


MOMENTS = Moments()


def sentences_of(row: UploadMoment) -> list[str]:
    """What the source left open at this moment."""
    return [said_of(note) for note in notes_from_document((row.report or {}).get("notes", []))]


# --- Private -----------------------------------------------------------------------------------


def _drawn(row: UploadMoment) -> Settlement:
    _, reading = _read(row, "preview")
    picture = f"{PREVIEWS}/{row.code}.png"
    store_as(picture, draw(reading.scene, Modification(), camera_for(reading.scene, None)))
    columns = {"picture": picture, "report": _report(reading)}
    return Settlement(state=State.DRAWN, columns=columns)


def _kept(row: UploadMoment) -> Settlement:
    source, reading = _read(row, row.slug)
    path = Path(row.upload.name)
    scene, _ = keep_reading(reading, source=source, path=path, actor=row.asked_by)
    return Settlement(state=State.KEPT, columns={"scene": scene})


def _read(row: UploadMoment, name: str) -> tuple[str, Reading]:
    with open_upload(row.upload) as file:
        return file.read(item=row.item or None, frame=row.frame, name=name)


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
