"""Recorded and written scenes from outside, as rows."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction

from augment.errors import Conflict
from augment.formats.apart import UntrustedInput
from augment.formats.reading import Reading
from augment.models import BaseScene
from augment.scene.codec import recording_to_document, scene_to_document
from augment.services.events import log_change
from augment.services.scenarios.scenes import content_hash
from augment.services.texts import check_slug, free_slug


def import_scene(
    *,
    source: str | None = None,
    path: Path,
    frame: int | None = None,
    item: str | None = None,
    slug: str | None = None,
) -> BaseScene:
    """Read a scene from outside and keep it, with its recording and what the source left open.

    Args:
        source: The name of a reader; None to recognise the format.
        path: The file or folder.
        frame: The step that becomes t0, from 0; None for what the format means.
        item: Which part of a file that holds several; None for the first.
        slug: The new scene's name; made of the file's when None.

    Raises:
        UnknownName: No such source.
        InvalidDocument: The input or the slug breaks its format.
        Conflict: The slug is taken, or the same scene is stored already.
    """
    slug = slug or free_scene_slug(path.name)
    check_slug(slug, what="scene")
    recorded = UntrustedInput(path=path, format=source)
    name, reading = recorded.read(item=item, frame=frame, name=slug)
    row, is_new = keep_reading(reading, source=name, path=path)
    if not is_new:
        raise Conflict(f"The same scene is stored already, as {row.slug!r}.")
    return row


def keep_reading(
    reading: Reading, *, source: str, path: Path, actor: User | None = None
) -> tuple[BaseScene, bool]:
    """Return the row of a scene that was read under its name, and whether it is new.

    Where the same scene is stored already, under whatever name, that row.

    Raises:
        Conflict: Another scene has the name.
    """
    document = scene_to_document(reading.scene)
    digest = content_hash(document)
    rows = BaseScene.objects.defer("document", "recording")
    same = rows.filter(content_hash=digest).first()
    if same is not None:
        return same, False
    slug, recording, moment = reading.scene.name, reading.recording, reading.moment
    after = {"slug": slug, "source": source, "path": path.name, "frame": moment.frame}
    try:
        with transaction.atomic():
            row = BaseScene.objects.create(
                slug=slug,
                document=document,
                recording=None if recording is None else recording_to_document(recording),
                source=source,
                source_item=moment.item or "",
                provenance=reading.scene.provenance,
                notes=list(reading.notes),
                content_hash=digest,
            )
            item = {} if moment.item is None else {"item": moment.item}
            log_change(row, "import", actor, after=after | item)
    except IntegrityError:
        raise Conflict(f"There is a scene called {slug!r} already; choose another slug.") from None
    return row, True


def note_sentences(notes: Iterable[Any]) -> list[str]:
    """Return the sentences on what the source of a scene left open, as rows keep them."""
    return [note if isinstance(note, str) else _earlier_sentence(note) for note in notes]


def free_scene_slug(name: str) -> str:
    """Return a slug for a scene, made of its name or of a file's before the first dot."""
    return free_slug(BaseScene.objects, name.partition(".")[0], otherwise="scene")


def _earlier_sentence(note: Mapping[str, Any]) -> str:
    """Return the sentence for an earlier release's kind with numbers and names."""
    words = str(note["kind"]).replace("_", " ").capitalize()
    parts = [*([str(note["number"])] if note.get("number") else []), *note.get("names", [])]
    return f"{words}: {', '.join(parts)}." if parts else f"{words}."
