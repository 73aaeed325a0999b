"""Each augmentation of a job with all that is measured of it: one line an augmentation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from django.db.models import Q

from augment.checks import Severity
from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.displacement import Displacement
from augment.models import Augmentation, GenerationJob
from augment.services.endpoints.known_models import AUGMENTATION, Spending, sum_spending
from augment.services.judging.displacement import of_job
from augment.services.judging.findings import findings_of


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
    spent = sum_spending(Q(attempt__augmentation__job=job), by=AUGMENTATION)
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
