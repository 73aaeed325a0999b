"""A job's modifications as interPlan's file, and such a file as reference modifications."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from augment.errors import InvalidDocument, UnknownName
from augment.formats import interplan_reader, interplan_writer
from augment.formats.interplan import Cell, Loss, ReadEntry, token_of
from augment.models import Augmentation, BaseScene, GenerationJob
from augment.scene.catalogue import ScenarioType
from augment.scene.codec import modification_from_document, scene_from_document
from augment.scene.modification import without_traffic
from augment.services.scenes import scene_of


def job_as_interplan(
    job: GenerationJob, *, contestant: str | None = None
) -> tuple[str, tuple[Loss, ...]]:
    """All that a job made, in interPlan's YAML, and what the file can't say.

    Args:
        job: Whose modifications are written, ordered by scenario and contestant.
        contestant: The slug of the only contestant to write; None for all.

    Raises:
        UnknownName: The job has no such contestant.
        Conflict: A scene has more modifications than interPlan can number.
    """
    rows = job.augmentations.select_related("scenario__base_scene", "contestant")
    slugs = sorted(set(rows.values_list("contestant__slug", flat=True)))
    if contestant is not None:
        if contestant not in slugs:
            raise UnknownName("contestant", contestant, slugs)
        rows = rows.filter(contestant__slug=contestant)
    cells, losses = [], []
    for row in rows.order_by("scenario__slug", "contestant__slug"):
        name = f"{row.scenario.slug} by {row.contestant.slug}"
        if row.modification is None:
            losses.append(Loss(cell=name, text=f"there is no modification: {row.state}"))
        else:
            cells.append(_cell(name, row))
    text, more = interplan_writer.write(cells)
    return text, (*losses, *more)


def references_from_interplan(
    path: Path, *, scenes: Mapping[str, str] | None = None
) -> tuple[ReadEntry, ...]:
    """The special scenarios of an interPlan file whose scenes are stored here.

    Args:
        path: The YAML file.
        scenes: Slugs of stored scenes in the file's frame by base token; None for the tokens
            that `job_as_interplan` makes from the scenes' names.

    Raises:
        UnknownName: No such scene.
        InvalidDocument: The file can't be read or breaks its format.
    """
    stored = {row.slug: row for row in BaseScene.objects.defer("recording")}
    if scenes is None:
        scenes = {token_of(slug): slug for slug in stored}
    for slug in scenes.values():
        if slug not in stored:
            raise UnknownName("scene", slug, sorted(stored))
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise InvalidDocument(interplan_reader.WHAT, [("", str(fault))]) from None
    return interplan_reader.read(
        text,
        {
            token: without_traffic(scene_from_document(stored[slug].document))
            for token, slug in scenes.items()
        },
    )


def _cell(name: str, row: Augmentation) -> Cell:
    return Cell(
        name=name,
        scene=scene_of(row.scenario),
        type=ScenarioType(row.scenario.type),
        modification=modification_from_document(row.modification),
        keeps_traffic=row.scenario.keep_traffic,
    )
