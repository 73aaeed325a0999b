"""Recorded and written scenes from outside, as rows."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction

from augment.errors import Conflict
from augment.formats.apart import UntrustedInput
from augment.formats.reading import Moment, Reading
from augment.models import BaseScene
from augment.scene.codec import recording_to_document, scene_to_document
from augment.scene.recording import Note, SceneNoteKind, notes_from_document, notes_to_document
from augment.services.events import log_change
from augment.services.scenarios.scenes import SLUG_LENGTH, check_slug, content_hash
from augment.simulation.planning import FALLBACK_LIMIT_MPS
from augment.simulation.traffic import FALLBACK_MPS


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedMoment:
    """One moment of a log.

    Attributes:
        row: The stored scene.
        is_new: False where the same scene was stored before.
    """

    moment: Moment
    row: BaseScene
    is_new: bool


def import_scene(
    *,
    source: str | None = None,
    path: Path,
    frame: int | None = None,
    item: str | None = None,
    slug: str,
    actor: User | None = None,
) -> BaseScene:
    """Read a scene from outside and keep it, with its recording and what the source left open.

    Args:
        source: The name of a reader; None to recognise the format.
        path: The file or folder.
        frame: The step that becomes t0, from 0; None for what the format means.
        item: Which part of a file that holds several; None for the first.
        slug: The new scene's name; lower-case letters, digits and hyphens.
        actor: Who did it.

    Raises:
        UnknownName: No such source.
        InvalidDocument: The input or the slug breaks its format.
        Conflict: The slug is taken, or the same scene is stored already.
    """
    check_slug(slug, what="scene")
    recorded = UntrustedInput(path=path, format=source)
    name, reading = recorded.read(item=item, frame=frame, name=slug)
    row, is_new = keep_reading(reading, source=name, path=path, actor=actor)
    if not is_new:
        raise Conflict(f"The same scene is stored already, as {row.slug!r}.")
    return row


def import_log(
    *,
    source: str | None = None,
    path: Path,
    every_s: float,
    limit: int | None = None,
    slug: str,
    actor: User | None = None,
) -> Iterator[ImportedMoment]:
    """Keep every so many seconds of a log as a scene of its own, one by one.

    Args:
        source: The name of a reader; None to recognise the format.
        path: The file or folder.
        every_s: How far the moments lie apart.
        limit: How many scenes at most.
        slug: What the names begin with; a number follows.
        actor: Who did it.

    Yields:
        Each moment once its scene is stored, or was found to be stored before.

    Raises:
        UnknownName, InvalidDocument, Conflict: As above; what was yielded before stays.
    """
    check_slug(f"{slug}-1", what="scene")
    log = UntrustedInput(path=path, format=source)
    names = _list_free(slug)
    name = next(names)
    for moment in log.moments(every_s=every_s)[:limit]:
        format_name, reading = log.read(item=moment.item, frame=moment.frame, name=name)
        row, is_new = keep_reading(reading, source=format_name, path=path, actor=actor)
        yield ImportedMoment(moment=moment, row=row, is_new=is_new)
        if is_new:
            name = next(names)


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
                notes=notes_to_document(reading.notes),
                content_hash=digest,
            )
            item = {} if moment.item is None else {"item": moment.item}
            log_change(row, "import", actor, after=after | item)
    except IntegrityError:
        raise Conflict(f"There is a scene called {slug!r} already; choose another slug.") from None
    return row, True


def notes_of(scene: BaseScene) -> list[str]:
    """Return every loss and assumption of a stored scene, as a sentence."""
    return [sentence_of(note) for note in notes_from_document(scene.notes)]


def sentence_of(note: Note) -> str:
    """Return a loss or assumption as a sentence."""
    if note.kind not in _TEXTS:  # of an earlier release
        words = note.kind.replace("_", " ").capitalize()
        details = ", ".join([*([str(note.number)] if note.number else []), *note.names])
        return f"{words}: {details}." if details else f"{words}."
    values = {
        "number": note.number or 0,
        "of": note.of or 0,
        "value": "" if note.value is None else f"{note.value:g}",
        "names": ", ".join(note.names),
        "ego": f"{FALLBACK_LIMIT_MPS:g}",
        "others": f"{FALLBACK_MPS:g}",
    }
    return _TEXTS[note.kind] % values


def _list_free(slug: str) -> Iterator[str]:
    """Yield the numbered names that no scene has."""
    for number in count(1):
        name = f"{slug[: SLUG_LENGTH - 8].strip('-')}-{number}"
        if not BaseScene.objects.filter(slug=name).exists():
            yield name


_Kind = SceneNoteKind
_TEXTS: dict[SceneNoteKind, str] = {
    _Kind.NO_SPEED_LIMITS: "No speed limits in this source: drives assume %(ego)s m/s for the "
    "ego and %(others)s m/s for others.",
    _Kind.SOME_SPEED_LIMITS: "%(number)s of %(of)s lanes have no speed limit: drives assume "
    "%(ego)s m/s for the ego and %(others)s m/s for others there.",
    _Kind.NO_LIGHTS: "No traffic lights in this source.",
    _Kind.NO_WALKWAYS: "No sidewalks in this source.",
    _Kind.NO_DRIVABLE_AREAS: "No drivable areas in this source: only lanes can be driven on.",
    _Kind.NO_CONNECTIVITY: "No lane of this source has a successor.",
    _Kind.NO_INTERSECTIONS: "No intersections in this source: no turn types, no lights.",
    _Kind.SOME_BOX_SIZES: "%(number)s of %(of)s objects got the usual size of their class.",
    _Kind.EGO_SIZE_ASSUMED: "The ego is assumed to be %(value)s m long.",
    _Kind.EGO_SIZE_SWAPPED: "The ego's length and width were swapped and put right.",
    _Kind.NO_EGO_MOTION: "The ego's motion was not recorded: drives are measured by an IDM drive.",
    _Kind.SPEEDS_DIFFERENCED: "Speeds were taken from the recorded places.",
    _Kind.LANE_WIDTHS_ASSUMED: "%(number)s of %(of)s lanes have no boundaries on both sides: "
    "%(value)s m wide where no neighbour tells.",
    _Kind.TRAFFIC_SIDE_ASSUMED: "That people drive on the %(names)s is what the place says.",
    _Kind.OBJECTS_LEFT_OUT: "%(number)s objects of no known class were left out: %(names)s.",
    _Kind.MAP_PARTS_LEFT_OUT: "%(number)s parts of the map were left out: %(names)s.",
    _Kind.FAR_PARTS_LEFT_OUT: "What is more than %(value)s m from the ego was left out.",
    _Kind.LONG_TIME_STEP: "Steps lie %(value)s s apart; a drive looks between them.",
    _Kind.SCENARIO_TAGS: "Scenario tags of this moment: %(names)s.",
    _Kind.INTERPLAN_LEFT_OUT: "What interPlan says besides and is not used here: %(names)s.",
    _Kind.NON_COMMERCIAL: "The data's licence, %(names)s, does not allow commercial use.",
}
