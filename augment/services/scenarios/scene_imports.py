"""Recorded and written scenes from outside, as rows."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
    _refuse_taken(slug)
    name, reading = UntrustedInput(path=path, format=source).read(
        item=item, frame=frame, name=slug
    )
    document = scene_to_document(reading.scene)
    same = _same(document)
    if same is not None:
        raise Conflict(f"The same scene is stored already, as {same.slug!r}.")
    return _keep(reading, document, source=name, path=path, slug=slug, actor=actor)


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
    number = 0
    for moment in log.moments(every_s=every_s)[:limit]:
        number, name = _free(slug, number)
        format_name, reading = log.read(item=moment.item, frame=moment.frame, name=name)
        document = scene_to_document(reading.scene)
        same = _same(document)
        if same is not None:
            number -= 1
            yield ImportedMoment(moment=moment, row=same, is_new=False)
            continue
        row = _keep(reading, document, source=format_name, path=path, slug=name, actor=actor)
        yield ImportedMoment(moment=moment, row=row, is_new=True)


def keep_reading(
    reading: Reading, *, source: str, path: Path, actor: User | None = None
) -> tuple[BaseScene, bool]:
    """The row of a scene that was read under its name, and whether it is new.

    Where the same scene is stored already, under whatever name, that row.

    Raises:
        Conflict: Another scene has the name.
    """
    document = scene_to_document(reading.scene)
    same = _same(document)
    if same is not None:
        return same, False
    slug = reading.scene.name
    return _keep(reading, document, source=source, path=path, slug=slug, actor=actor), True


# Private


def _refuse_taken(slug: str) -> None:
    if BaseScene.objects.filter(slug=slug).exists():
        raise Conflict(f"There is a scene called {slug!r} already; choose another slug.")


def _same(document: dict[str, Any]) -> BaseScene | None:
    rows = BaseScene.objects.defer("document", "recording")
    return rows.filter(content_hash=content_hash(document)).first()


def _free(slug: str, number: int) -> tuple[int, str]:
    """The next number whose name is free."""
    while True:
        number += 1
        name = f"{slug[: SLUG_LENGTH - 8].strip('-')}-{number}"
        if not BaseScene.objects.filter(slug=name).exists():
            return number, name


@transaction.atomic
def _keep(
    reading: Reading,
    document: dict[str, Any],
    *,
    source: str,
    path: Path,
    slug: str,
    actor: User | None,
) -> BaseScene:
    recording = reading.recording
    try:
        with transaction.atomic():
            row = BaseScene.objects.create(
                slug=slug,
                document=document,
                recording=None if recording is None else recording_to_document(recording),
                source=source,
                source_item=reading.moment.item or "",
                provenance=reading.scene.provenance,
                notes=notes_to_document(reading.notes),
                content_hash=content_hash(document),
            )
    except IntegrityError:  # somebody else was faster
        raise Conflict(f"There is a scene called {slug!r} already; choose another slug.") from None
    after = {"slug": slug, "source": source, "path": path.name, "frame": reading.moment.frame}
    if reading.moment.item is not None:
        after["item"] = reading.moment.item
    log_change(row, "import", actor, after=after)
    return row


def notes_of(scene: BaseScene) -> list[str]:
    """Every loss and assumption of a stored scene, as a sentence."""
    return [said_of(note) for note in notes_from_document(scene.notes)]


def said_of(note: Note) -> str:
    """A loss or assumption as a sentence."""
    values = {
        "number": note.number or 0,
        "of": note.of or 0,
        "value": "" if note.value is None else f"{note.value:g}",
        "names": ", ".join(note.names),
        "ego": f"{FALLBACK_LIMIT_MPS:g}",
        "others": f"{FALLBACK_MPS:g}",
    }
    return _TEXTS[note.kind] % values


_TEXTS: dict[SceneNoteKind, str] = {
    SceneNoteKind.NO_SPEED_LIMITS: (
        "No speed limits in this source: a drive assumes %(ego)s m/s for the ego and %(others)s"
        " m/s for others."
    ),
    SceneNoteKind.SOME_SPEED_LIMITS: (
        "%(number)s of %(of)s lanes have no speed limit: a drive assumes %(ego)s m/s for the ego"
        " and %(others)s m/s for others there."
    ),
    SceneNoteKind.SPEED_LIMITS_IGNORED: (
        "The speed limit of %(number)s lanes is a constant %(value)s m/s that means nothing; it"
        " was left out."
    ),
    SceneNoteKind.NO_LIGHTS: (
        "No traffic lights in this source: their state is unknown everywhere."
    ),
    SceneNoteKind.NO_WALKWAYS: "No sidewalks in this source.",
    SceneNoteKind.NO_DRIVABLE_AREAS: (
        "No drivable areas in this source: what can be driven on is the lanes alone."
    ),
    SceneNoteKind.NO_CONNECTIVITY: (
        "This source does not say which lane leads to which: no lane has a successor."
    ),
    SceneNoteKind.NO_INTERSECTIONS: (
        "No intersections in this source: where lanes part, they are lanes, not connectors, and"
        " have neither turn type nor light."
    ),
    SceneNoteKind.NO_BOX_SIZES: (
        "No box sizes in this source: every object has the usual size of its class."
    ),
    SceneNoteKind.SOME_BOX_SIZES: (
        "%(number)s of %(of)s objects have no box size: the usual size of their class was taken."
    ),
    SceneNoteKind.EGO_SIZE_ASSUMED: (
        "The ego's size is not in this source: %(value)s m long was assumed."
    ),
    SceneNoteKind.EGO_SIZE_SWAPPED: (
        "The ego's length and width were swapped in this source; they were put right."
    ),
    SceneNoteKind.NO_EGO_MOTION: (
        "The ego's own motion was not recorded: a drive is measured against an IDM drive."
    ),
    SceneNoteKind.SPEEDS_DIFFERENCED: (
        "No speeds in this source: they were taken from the recorded places."
    ),
    SceneNoteKind.LANE_WIDTHS_ASSUMED: (
        "%(number)s of %(of)s lanes have no boundaries on both sides: where nothing beside them"
        " told the width, %(value)s m was assumed."
    ),
    SceneNoteKind.TRAFFIC_SIDE_ASSUMED: (
        "No two oncoming lanes lie side by side: that people drive on the %(names)s is what the"
        " place says."
    ),
    SceneNoteKind.BICYCLE_LANES_LEFT_OUT: ("%(number)s bicycle lanes of the map were left out."),
    SceneNoteKind.OBJECTS_LEFT_OUT: (
        "%(number)s objects were left out, which no class here fits: %(names)s."
    ),
    SceneNoteKind.CLASSES_MERGED: ("Finer classes of this source count as ours: %(names)s."),
    SceneNoteKind.MAP_PARTS_LEFT_OUT: (
        "%(number)s parts of the map have no place here and were left out: %(names)s."
    ),
    SceneNoteKind.FAR_PARTS_LEFT_OUT: (
        "Parts of the map and objects more than %(value)s m from the ego were left out."
    ),
    SceneNoteKind.LIGHTS_REPEATED: (
        "%(number)s lights are programmed, not recorded: their state is that of the cycle at t0."
    ),
    SceneNoteKind.BOUNDARIES_TURNED: (
        "%(number)s boundaries ran against their lane and were turned."
    ),
    SceneNoteKind.TURN_TYPES_CORRECTED: (
        "The turn type of %(number)s connectors contradicts their shape; the shape was believed."
    ),
    SceneNoteKind.LONG_TIME_STEP: (
        "Steps of this recording lie %(value)s s apart; a drive looks between them."
    ),
    SceneNoteKind.ROUTE: (
        "The source's route leads over %(number)s roadblocks: %(names)s. A drive follows the"
        " recorded way instead."
    ),
    SceneNoteKind.ROUTE_NOT_IN_MAP: (
        "%(number)s of %(of)s roadblocks of the route are not in the map: %(names)s."
    ),
    SceneNoteKind.MISSION_GOAL: (
        "The mission's goal lies %(names)s m ahead of the ego and to its left; no drive is"
        " measured by it."
    ),
    SceneNoteKind.SCENARIO_TAGS: ("Scenario tags of this moment: %(names)s."),
    SceneNoteKind.INTERPLAN_LEFT_OUT: (
        "What interPlan says besides and is not used here: %(names)s."
    ),
    SceneNoteKind.NON_COMMERCIAL: (
        "The data's licence, %(names)s, does not allow commercial use."
    ),
}
