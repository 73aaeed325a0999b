"""A job's modifications as interPlan's file, and such a file as reference modifications."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.formats.documents import read_yaml_file
from augment.formats.interplan.file import WHAT, InterplanSource, ReadFile, token_of
from augment.formats.interplan.reader import read_document
from augment.formats.interplan.writer import interplan_text
from augment.formats.nuplan_log import NuPlan
from augment.formats.writing import Cell, Loss
from augment.models import Augmentation, BaseScene, GenerationJob, Scenario
from augment.scene.codec import modification_from_document, scene_from_document
from augment.scene.entities import without_traffic
from augment.services.scenarios.scenes import scene_of, type_of

NUPLAN = NuPlan.name
_MOST_LISTED = 12


def job_as_interplan(
    job: GenerationJob, *, contestant: str | None = None, strict: bool = False
) -> tuple[str, tuple[Loss, ...]]:
    """All that a job made, in interPlan's YAML, and what the file can't say.

    Args:
        job: Whose modifications are written, ordered by scenario and contestant.
        contestant: The slug of the only contestant to write; None for all.
        strict: Whether nothing is written once a scenario would not be the same there.

    Raises:
        UnknownName: The job has no such contestant.
        Conflict: A scene has more modifications than interPlan can number, or `strict` and
            something would change.
    """
    rows = job.augmentations.select_related("scenario__base_scene", "contestant")
    slugs = sorted(set(rows.values_list("contestant__slug", flat=True)))
    if contestant is not None:
        if contestant not in slugs:
            raise UnknownName("contestant", contestant, slugs)
        rows = rows.filter(contestant__slug=contestant)
    cells, losses = [], []
    for row in rows.order_by("scenario__slug", "contestant__slug", "sample"):
        name = f"{row.scenario.slug} by {row.contestant.slug}"
        if job.samples > 1:
            name += f", sample {row.sample}"
        if row.modification is None:
            text = f"there is no modification: {row.state}"
            losses.append(Loss(cell=name, text=text, changes_scene=True))
        else:
            cells.append(_cell(name, row))
    text, more = interplan_text(cells)
    losses += more
    if strict:
        refuse_changes(losses, where="interPlan")
    return text, tuple(losses)


def references_from_interplan(path: Path, *, scenes: Mapping[str, str] | None = None) -> ReadFile:
    """The special scenarios of an interPlan file whose scenes are stored here.

    Args:
        path: The YAML file.
        scenes: Slugs of stored scenes in the file's frame by base token; None for the tokens
            that `job_as_interplan` makes from the scenes' names.

    Raises:
        UnknownName: No such scene, or no such base token in the file.
        InvalidDocument: The file can't be read or breaks its format.
    """
    stored = {row.slug: row for row in BaseScene.objects.defer("recording")}
    given = tuple(scenes or ())
    if scenes is None:
        scenes = {token_of(slug): slug for slug in stored}
        scenes |= {row.source_item: row.slug for row in stored.values() if row.source == NUPLAN}
    for slug in scenes.values():
        if slug not in stored:
            raise UnknownName("scene", slug, sorted(stored))
    document = read_yaml_file(path, what=WHAT)
    known = {
        token: without_traffic(scene_from_document(stored[slug].document))
        for token, slug in scenes.items()
    }
    file = read_document(document, known)
    tokens = [*dict.fromkeys(entry.id.partition("-")[0] for entry in file.entries)]
    there = sorted({*tokens, *file.passed_over})
    for token in given:
        if token not in there:
            raise UnknownName("base token", token, there)
    if not file.entries:
        raise InvalidDocument(
            WHAT,
            [
                (
                    "modification_details_dictionary",
                    f"none of its {len(there)} base tokens has a scene here: "
                    f"{', '.join(there[:_MOST_LISTED])}; name the scenes by --scene TOKEN=SLUG",
                )
            ],
        )
    return file


def refuse_changes(losses: Sequence[Loss], *, where: str) -> None:
    """Raise Conflict once a scenario would not be the same there."""
    changes = [loss for loss in losses if loss.changes_scene]
    if changes:
        shown = "; ".join(str(loss) for loss in changes[:_MOST_LISTED])
        more = len(changes) - _MOST_LISTED
        rest = f"; and {more} more" if more > 0 else ""
        raise Conflict(
            f"{len(changes)} things would not be the same in {where}, and nothing was written: "
            f"{shown}{rest}."
        )


def _cell(name: str, row: Augmentation) -> Cell:
    return Cell(
        name=name,
        scene=scene_of(row.scenario),
        type=type_of(row.scenario.type),
        modification=modification_from_document(row.modification),
        keeps_traffic=row.scenario.keep_traffic,
        source=_source(row.scenario),
    )


def _source(scenario: Scenario) -> InterplanSource | None:
    """Where a scenario comes from in nuPlan, None for a scene of another source."""
    row = scenario.base_scene
    if row.source != NUPLAN or not row.source_item:
        return None
    return InterplanSource(token=row.source_item, **(scenario.interplan or {}))
