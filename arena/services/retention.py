"""What language models were asked and answered is removed once it is old; the numbers stay.

A call keeps who was asked in which role, tokens, money and times; its messages and its answer go,
and the images that no other call names. Modifications, pictures and votes are not touched. What
goes can't be used again: the same request is asked, and paid, anew, and transcripts are without
words. Nothing of a job that is not over goes, and nothing that an unfinished study shows.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Count, Q, QuerySet, Sum, TextField
from django.db.models.functions import Cast, Coalesce, Length

from arena.models import Matchup, Study
from augment.errors import Conflict, InvalidDocument
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.events import log_event
from augment.services.running.jobs import OPEN
from augment.services.running.transcript_records import delete_unnamed, images_named_by

BATCH = 200
"""So many calls are emptied in one transaction, so that nobody waits for long."""

_AGE = re.compile(r"(\d{1,5})([dw])")
_DAYS = {"d": 1, "w": 7}


@dataclass(frozen=True, slots=True, kw_only=True)
class TextLoss:
    """What goes of one job, or of the readings of instructions where `job` is None.

    Attributes:
        calls: Whose messages go, and of these `answers` have an answer.
        transcripts: Augmentations whose transcripts are without words afterwards.
        characters: Of requests and answers.
    """

    job: GenerationJob | None
    calls: int
    answers: int
    transcripts: int
    characters: int


def read_age(text: str) -> timedelta:
    """An age as it is entered: 180d or 26w.

    Raises:
        InvalidDocument: It is none, or below a day.
    """
    found = _AGE.fullmatch(text.strip())
    days = int(found[1]) * _DAYS[found[2]] if found else 0
    if not days:
        said = f"expected days or weeks as in 180d or 26w, not {text!r}"
        raise InvalidDocument("age", [("", said)])
    return timedelta(days=days)


def foresee_losses(*, before: datetime) -> list[TextLoss]:
    """What would go, job by job, the oldest first; two queries and one for each job.

    Args:
        before: Calls that began earlier are old.
    """
    calls = _removable(before)
    jobs = GenerationJob.objects.filter(
        pk__in=calls.order_by().values("attempt__augmentation__job").distinct()
    )
    losses = [
        _loss(job, calls.filter(attempt__augmentation__job=job))
        for job in jobs.order_by("created_at", "pk")
    ]
    readings = calls.filter(reading__isnull=False)
    return losses + ([_loss(None, readings)] if readings.exists() else [])


def remove_old(
    *, before: datetime, now: datetime, actor: User | None = None
) -> Iterator[tuple[TextLoss, int]]:
    """Empty old calls, job by job; each job with how many of its calls are done so far.

    What is to go is logged first. Stopped halfway, it has emptied whole batches, and the next
    run does the rest.

    Raises:
        Conflict: A job was resumed or a study opened meanwhile, so that some calls may not go.
    """
    for loss in foresee_losses(before=before):
        whose = Q(reading__isnull=False)
        if loss.job is not None:
            whose = Q(attempt__augmentation__job=loss.job)
        calls = _removable(before).filter(whose)
        keys = list(calls.order_by("pk").values_list("pk", flat=True))
        images = images_named_by(keys)
        _log(loss, before, actor)
        for start in range(0, len(keys), BATCH):
            _empty(keys[start : start + BATCH], before=before, now=now)
            yield loss, min(start + BATCH, len(keys))
        delete_unnamed(images)


# --- Private -----------------------------------------------------------------------------------


def _removable(before: datetime) -> QuerySet[ModelCall]:
    """Old calls with their words, of jobs that are over, which no unfinished study shows."""
    unfinished = Matchup.objects.exclude(study__state=Study.State.CLOSED).order_by()
    shown = Augmentation.objects.filter(
        Q(pk__in=unfinished.values("left")) | Q(pk__in=unfinished.values("right"))
    ).values("pk")
    kept = Q(attempt__augmentation__in=shown) | Q(attempt__augmentation__job__state__in=OPEN)
    # Whoever was answered from a call counts it as the source of what it shows.
    sources = ModelCall.objects.filter(kept, served_from__isnull=False).values("served_from")
    old = ModelCall.objects.filter(
        started_at__lt=before, settled_at__isnull=False, removed_at__isnull=True
    )
    of_jobs_over = Q(attempt__isnull=True) | ~Q(attempt__augmentation__job__state__in=OPEN)
    not_shown = Q(attempt__isnull=True) | ~Q(attempt__augmentation__in=shown)
    return old.filter(of_jobs_over, not_shown).exclude(pk__in=sources)


def _loss(job: GenerationJob | None, calls: QuerySet[ModelCall]) -> TextLoss:
    long = Length(Cast("request", TextField())) + Coalesce(Length("answer"), 0)
    found = calls.order_by().aggregate(
        calls=Count("pk"),
        answers=Count("pk", filter=Q(answer__isnull=False)),
        transcripts=Count("attempt__augmentation", distinct=True),
        characters=Sum(long),
    )
    return TextLoss(
        job=job,
        calls=found["calls"],
        answers=found["answers"],
        transcripts=found["transcripts"],
        characters=found["characters"] or 0,
    )


@transaction.atomic
def _empty(keys: list[int], *, before: datetime, now: datetime) -> None:
    """The messages and the answers of a batch; held, so that no job is resumed in between."""
    rows = list(ModelCall.objects.select_for_update().filter(pk__in=keys).order_by("pk"))
    if _removable(before).filter(pk__in=keys).count() != len(keys):
        raise Conflict(
            "A job went on or a study was opened meanwhile; the rest is kept. Run it again."
        )
    for row in rows:
        row.request = {name: said for name, said in row.request.items() if name != "messages"}
        row.answer = None if row.answer is None else ""
        row.refusal = None if row.refusal is None else ""
        row.extras, row.request_hash, row.removed_at = None, "", now
    columns = ("request", "answer", "refusal", "extras", "request_hash", "removed_at")
    ModelCall.objects.bulk_update(rows, columns)


def _log(loss: TextLoss, before: datetime, actor: User | None) -> None:
    after: dict[str, Any] = {
        "older_than": before.isoformat(),
        "calls": loss.calls,
        "answers": loss.answers,
        "transcripts": loss.transcripts,
        "characters": loss.characters,
    }
    kind, code = ("reading", "all") if loss.job is None else ("job", str(loss.job.code))
    log_event(actor=actor, verb="prune", object_kind=kind, object_code=code, after=after)
