"""How the contestants of a job called their function: tried, understood, mended."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from django.db.models import Max

from augment.models import Augmentation, GenerationJob, TranscriptNote
from augment.variants.respondents import NoteKind


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCallLine:
    """The calls of one contestant, or of one augmentation where there is one.

    Attributes:
        scenario, augmentation: Slug and code of the one augmentation, empty for a contestant.
        augmentations: Those that called at all.
        attempted: Calls in any form, those after the last that is answered included.
        understood: Those of them that could be read.
        mended: Those of them that were not in the form that was asked for.
    """

    contestant: str
    name: str
    is_simulated: bool
    attempted: int
    understood: int
    mended: int
    augmentations: int = 1
    scenario: str = ""
    augmentation: str = ""


def tool_calls_by_augmentation(job: GenerationJob) -> list[ToolCallLine]:
    """One line for each augmentation whose latest attempt called, by contestant and scenario."""
    latest = dict(
        Augmentation.objects.filter(job=job)
        .values_list("pk")
        .annotate(latest=Max("attempts__number"))
    )
    counted: defaultdict[int, list[tuple[bool, bool]]] = defaultdict(list)
    notes = TranscriptNote.objects.filter(
        attempt__augmentation__job=job, kind=NoteKind.TOOL_CALL
    ).values_list("attempt__augmentation_id", "attempt__number", "document")
    for augmentation_id, number, document in notes:
        if number == latest[augmentation_id]:
            # Notes from before these were counted don't say it.
            read = "error" not in document.get("result", {})
            flags = bool(document.get("understood", read)), bool(document.get("mended", False))
            counted[augmentation_id].append(flags)
    rows = (
        Augmentation.objects.filter(pk__in=counted)
        .select_related("contestant", "scenario")
        .defer("modification")
        .order_by("contestant__slug", "scenario__slug", "pk")
    )
    return [
        ToolCallLine(
            contestant=row.contestant.slug,
            name=row.contestant.name,
            is_simulated=row.contestant.is_simulated,
            attempted=len(counted[row.pk]),
            understood=sum(understood for understood, _ in counted[row.pk]),
            mended=sum(mended for _, mended in counted[row.pk]),
            scenario=row.scenario.slug,
            augmentation=str(row.code),
        )
        for row in rows
    ]


def tool_calls_by_contestant(job: GenerationJob) -> list[ToolCallLine]:
    """One line for each contestant that called, by slug."""
    groups: defaultdict[str, list[ToolCallLine]] = defaultdict(list)
    for line in tool_calls_by_augmentation(job):
        groups[line.contestant].append(line)
    return [
        ToolCallLine(
            contestant=slug,
            name=lines[0].name,
            is_simulated=lines[0].is_simulated,
            attempted=sum(line.attempted for line in lines),
            understood=sum(line.understood for line in lines),
            mended=sum(line.mended for line in lines),
            augmentations=len(lines),
        )
        for slug, lines in sorted(groups.items())
    ]
