"""Each augmentation of a job with all that is measured of it: one line an augmentation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from django.db.models import BigIntegerField, Case, Count, F, Q, Sum, When
from django.db.models.functions import Coalesce

from augment.checks import Severity
from augment.errors import InvalidDocument, InvalidModification
from augment.llm.costs import NANO_USD
from augment.metrics.displacement import Displacement
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.judging.checks import findings_of
from augment.services.judging.displacement import of_job


@dataclass(frozen=True, slots=True, kw_only=True)
class Spending:
    """The calls of one augmentation; an answer from the store counts as what it had cost.

    Attributes:
        tokens: Prompt and completion, None where a call does not say.
        nano_usd: None where the price of a call is unknown.
    """

    calls: int
    tokens: int | None
    nano_usd: int | None

    @property
    def usd(self) -> float | None:
        """The same in dollars."""
        return None if self.nano_usd is None else self.nano_usd / NANO_USD


@dataclass(frozen=True, slots=True, kw_only=True)
class AugmentationLine:
    """One augmentation.

    Attributes:
        displacement: None where nothing can be measured.
        spending: None where no model was asked.
        wrong, doubtful: Findings of the checks, None where nothing was checked.
    """

    row: Augmentation
    displacement: Displacement | None
    spending: Spending | None
    wrong: int | None = None
    doubtful: int | None = None


def augmentation_lines(
    job: GenerationJob, *, with_checks: bool = True
) -> Iterator[AugmentationLine]:
    """Every row of a job, by scenario, contestant and sample; three queries.

    Args:
        job: Whose rows.
        with_checks: Whether the checks are run, which takes some milliseconds a row.
    """
    spent = _spent(job)
    scenes = {}
    if with_checks:
        rows = job.augmentations.select_related("scenario__base_scene")
        scenes = {row.pk: row for row in rows.defer("scenario__base_scene__recording")}
    for one in of_job(job):
        wrong, doubtful = _faults(scenes[one.row.pk]) if with_checks else (None, None)
        yield AugmentationLine(
            row=one.row,
            displacement=one.displacement,
            spending=spent.get(one.row.pk),
            wrong=wrong,
            doubtful=doubtful,
        )


# --- Private -----------------------------------------------------------------------------------


def _faults(row: Augmentation) -> tuple[int, int] | tuple[None, None]:
    if row.modification is None or row.state != Augmentation.State.DONE:
        return None, None
    try:
        found = [one.severity for one in findings_of(row)]
    except (InvalidDocument, InvalidModification):
        return None, None
    return found.count(Severity.WRONG), found.count(Severity.DOUBTFUL)


def _spent(job: GenerationJob) -> dict[int, Spending]:
    """By augmentation, over its attempts that came to an outcome; one query."""
    tokens = Coalesce(
        F("served_from__prompt_tokens") + F("served_from__completion_tokens"),
        F("prompt_tokens") + F("completion_tokens"),
        # An endpoint that answered with an error used none, and that is known.
        Case(When(is_cost_estimated=False, served_from=None, then=F("spent_tokens"))),
        output_field=BigIntegerField(),
    )
    money = Coalesce("served_from__cost_nano_usd", "cost_nano_usd")
    rows = (
        ModelCall.objects.filter(
            Q(sent_at__isnull=False) | Q(served_from__isnull=False),
            attempt__augmentation__job=job,
            attempt__outcome__in=[state.value for state in Augmentation.SHOWABLE],
        )
        .order_by()
        .values(who=F("attempt__augmentation"))
        .annotate(
            calls=Count("pk"),
            tokens=Sum(tokens),
            with_tokens=Count(tokens),
            money=Sum(money),
            with_money=Count(money),
        )
    )
    return {
        row["who"]: Spending(
            calls=row["calls"],
            tokens=row["tokens"] if row["with_tokens"] == row["calls"] else None,
            nano_usd=row["money"] if row["with_money"] == row["calls"] else None,
        )
        for row in rows
    }
