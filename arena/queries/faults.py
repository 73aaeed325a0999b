"""What an expert labels next, and how far everybody is."""

from __future__ import annotations

from dataclasses import dataclass
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Count, Q, QuerySet

from arena.errors import NotYours
from arena.models import FaultLabel, LabellingRound, LabelTask
from augment.models import Augmentation, Contestant, GenerationJob


@dataclass(frozen=True, slots=True, kw_only=True)
class LabellingProgress:
    """A labelling and how many of its planned showings have a label."""

    labelling: LabellingRound
    planned: int
    labelled: int

    @property
    def left(self) -> int:
        """What still waits for a label: nothing in a closed labelling."""
        return 0 if self.labelling.closed_at else self.planned - self.labelled


def of_expert(expert: User) -> list[LabellingProgress]:
    """The labellings that an expert was invited to, counted over their own showings."""
    rows = LabellingRound.objects.filter(tasks__expert=expert)
    return _counted(rows)


def of_job(job: GenerationJob) -> list[LabellingProgress]:
    """The labellings of a job over all their experts."""
    return _counted(job.labellings.all())


def labelling_of(*, expert: User, code: UUID) -> LabellingProgress:
    """One of the expert's own labellings.

    Raises:
        NotYours: There is none with that code, or the expert takes no part in it.
    """
    progress = _counted(LabellingRound.objects.filter(code=code, tasks__expert=expert))
    if not progress:
        raise NotYours("You do not take part in this labelling.")
    return progress[0]


def next_task(*, labelling: LabellingRound, expert: User) -> LabelTask | None:
    """What the expert labels next, None when all is done or the labelling is closed."""
    if labelling.closed_at is not None:
        return None
    waiting = labelling.tasks.filter(expert=expert, label=None)
    return (
        waiting.select_related("augmentation__scenario")
        .defer("augmentation__modification", "augmentation__scenario__reference")
        .order_by("position")
        .first()
    )


def labels_of(job: GenerationJob) -> QuerySet[FaultLabel]:
    """Every label on the augmentations of a job, each with its augmentation's contestant."""
    found = FaultLabel.objects.filter(augmentation__job=job).select_related("augmentation")
    return found.only(*_LABEL, "augmentation__contestant").order_by("augmentation", "pk")


def contestants_of(job: GenerationJob) -> list[tuple[Contestant, int]]:
    """The contestants of a job by name, each with its answers that are none; two queries."""
    missed = Q(state__in=(Augmentation.State.UNREADABLE, Augmentation.State.REFUSED))
    counted = dict(
        job.augmentations.order_by()
        .values_list("contestant")
        .annotate(missed=Count("pk", filter=missed))
    )
    found = Contestant.objects.filter(pk__in=counted).order_by("name", "slug")
    return [(who, counted[who.pk]) for who in found.only("name", "slug", "kind")]


_LABEL = (
    *("augmentation", "position", "heading", "logic"),
    *("guessed_position", "guessed_heading", "guessed_logic"),
)


def _counted(rows: QuerySet[LabellingRound]) -> list[LabellingProgress]:
    counted = rows.annotate(
        planned=Count("tasks", distinct=True), labelled=Count("tasks__label", distinct=True)
    )
    return [
        LabellingProgress(labelling=row, planned=row.planned, labelled=row.labelled)
        for row in counted
    ]
