"""A job's grid, some rows at a time; drives, labellings and what a study shows of jobs."""

from collections import defaultdict
from dataclasses import fields
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.core.paginator import Paginator
from django.db.models import Case, Count, F, QuerySet, When

from arena.errors import NotYours
from arena.models import LabellingRound, LabelTask, Study
from arena.shell.listing import Listing
from augment.models import Augmentation, Contestant, GenerationJob, Scenario, Simulation
from augment.services.driving.simulations import Options

State = Augmentation.State

_LEAN = (*("code", "state", "sample", "image", "scenario_id", "contestant_id"), "job_id")


CELLS = 240
"""About so many cells are sent at once; whoever scrolls on gets as many again."""


def grid_part(job: GenerationJob, listing: Listing, page: int) -> dict[str, Any]:
    """Return scenarios down, contestants across; four queries, however large the job is.

    Rows come in pages, counted from 1; beyond the last one it is the last one. Each row has a
    scenario and its samples by contestant.
    """
    cells = job.augmentations.order_by()
    rows = Contestant.objects.filter(pk__in=cells.values("contestant"))
    contestants = list(rows.only("slug", "name", "kind", "code").order_by("name", "pk"))
    shown = listing.narrow(cells, "scenario__slug", by=["state"])
    scenarios = Scenario.objects.filter(pk__in=shown.values("scenario"))
    wide = max(1, len(contestants)) * job.samples
    ordered = scenarios.only("slug", "type", "code").order_by("type", "slug")
    lines = Paginator(ordered, max(1, CELLS // wide)).get_page(page)
    by_place: defaultdict[tuple[int, int], list[Augmentation]] = defaultdict(list)
    wanted = cells.filter(scenario__in=list(lines.object_list))
    for cell in wanted.only(*_LEAN).order_by("sample"):
        by_place[cell.scenario_id, cell.contestant_id].append(cell)
    return {
        "contestants": contestants,
        "scenarios": lines,
        "rows": [
            {"scenario": row, "cells": [by_place[row.pk, who.pk] for who in contestants]}
            for row in lines.object_list
        ],
    }


# --- Drives ------------------------------------------------------------------------------------


def find_unmodified_drive(row: Simulation) -> Simulation | None:
    """The same scene before the change, driven the same way; None until that is done."""
    options = Options(**{field.name: getattr(row, field.name) for field in fields(Options)})
    rows = options.of(Simulation.objects.filter(scenario_id=row.scenario_id))
    drives = rows.filter(subject=Simulation.Subject.UNMODIFIED, state=Simulation.State.DONE)
    return drives.exclude(pk=row.pk).first()


def list_shown_ids(study: Study) -> frozenset[int]:
    """The primary keys of all augmentations in the study's matchups; one query."""
    rows = study.matchups.order_by().values_list("left", "right").distinct()
    return frozenset(pk for pair in rows for pk in pair)


# --- Labellings --------------------------------------------------------------------------------


def find_labellings(**narrow: Any) -> QuerySet[Any]:
    """Return labellings; of those that are narrowed to an expert's, their own showings count.

    Each has `planned` and `labelled`, and what is `left`, which is 0 in a closed one.
    """
    counted = LabellingRound.objects.filter(**narrow).annotate(
        planned=Count("tasks", distinct=True), labelled=Count("tasks__label", distinct=True)
    )
    left = Case(When(closed_at=None, then=F("planned") - F("labelled")), default=0)
    return counted.annotate(left=left)


def labelling_progress(*, expert: User, code: UUID) -> Any:
    """One of the expert's own labellings, as `find_labellings` returns it.

    Raises:
        NotYours: There is none with that code, or the expert takes no part in it.
    """
    labelling = find_labellings(code=code, tasks__expert=expert).first()
    if labelling is None:
        raise NotYours("You do not take part in this labelling.")
    return labelling


def next_task(*, labelling: LabellingRound, expert: User) -> LabelTask | None:
    """Return the expert's next task, None when all is done or the labelling is closed."""
    if labelling.closed_at is not None:
        return None
    waiting = labelling.tasks.filter(expert=expert, label=None)
    return (
        waiting.select_related("augmentation__scenario")
        .defer("augmentation__modification", "augmentation__scenario__reference")
        .order_by("position")
        .first()
    )
