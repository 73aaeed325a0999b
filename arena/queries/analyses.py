"""A job's analyses, kept by each process as long as nothing that they follow from has changed.

The bootstrap over a thousand scenarios takes seconds; reading what it starts from does not.
"""

from __future__ import annotations

import hashlib
from collections.abc import Hashable

from django.db.models import TextField
from django.db.models.functions import Cast

from arena.queries.remembering import Remembered
from augment.models import Contestant, GenerationJob, Scenario
from augment.services.judging.analyses import JobAnalysis, analyse_job


def analysis_of(job: GenerationJob) -> JobAnalysis:
    """Everything about a job; three queries, and one more where it is not kept."""
    return _ANALYSED.get(analysed_from(job), lambda: analyse_job(job))


def analysed_from(job: GenerationJob) -> Hashable:
    """Another value whenever a row of the job, a scenario or a contestant of it changes.

    Stored documents are compared as text, which costs a tenth of parsing them.
    """
    rows = job.augmentations.order_by("pk").values_list(
        "pk", "state", "scenario", "contestant", "sample", Cast("modification", TextField())
    )
    mine = job.augmentations.order_by()
    scenarios = Scenario.objects.filter(pk__in=mine.values("scenario")).order_by("pk")
    contestants = Contestant.objects.filter(pk__in=mine.values("contestant")).order_by("pk")
    read = (
        rows,
        scenarios.values_list(
            *("pk", "slug", "paraphrase_of"),
            *(Cast(name, TextField()) for name in ("intent", "reference")),
        ),
        contestants.values_list("pk", "slug", "name", "kind"),
    )
    found = hashlib.sha256()
    for lines in read:
        found.update(repr(list(lines)).encode())
    return (job.pk, found.digest())


# --- Private -----------------------------------------------------------------------------------

_ANALYSED: Remembered[JobAnalysis] = Remembered(10)
