"""Rows of all rooms: old transcripts removed, restored rows checked, unfinished work ended.

What language models were asked and answered is removed once it is old; the numbers stay.

A call keeps who was asked in which role, tokens, money and times; its messages and its answer go,
and the images that no other call names. Modifications, pictures and votes are not touched. What
goes can't be used again: the same request is asked, and paid, anew, and transcripts are without
words. Nothing of a job that is not over goes, and nothing that an unfinished study shows.
"""

from collections.abc import Iterator, Mapping
from datetime import datetime
from uuid import uuid4

from django.apps import apps
from django.contrib.auth.models import User
from django.core.exceptions import ValidationError
from django.db import models, transaction
from django.db.models import F, Q, QuerySet

from arena.errors import ArenaError
from arena.jobs.services import NOTE_LENGTH
from arena.models import FaultLabel, Matchup, Report, Snapshot, Study, Vote
from arena.rating.rules import Intervals, Method, Unit
from arena.studies.services.experts import Complaint, check_complaint
from arena.studies.services.opening import check_seed
from arena.studies.services.planning import rules_of
from arena.voting.services.casting import decision_of
from augment.errors import AugmentError, Conflict
from augment.models import FAILED, Augmentation, GenerationJob, ModelCall, Work
from augment.services import row_rules
from augment.services.events import log_event
from augment.services.running.jobs import OPEN
from augment.services.running.transcript_records import delete_unnamed, images_named_by
from augment.services.texts import check_picture_name, one_line

BATCH = 200
"""So many calls are emptied in one transaction, so that nobody waits for long."""


def find_removable(before: datetime) -> QuerySet[ModelCall]:
    """Return calls from before then with their words that no job or study under way needs."""
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
    return old.exclude(pk__in=ModelCall.objects.filter(kept).values("pk")).exclude(pk__in=sources)


def remove_old(
    *, before: datetime, now: datetime, actor: User | None = None
) -> Iterator[tuple[int, int]]:
    """Empty old calls in batches; yield how many are done, of how many.

    It is logged first. Stopped halfway, it has emptied whole batches, and the next run does the
    rest.

    Raises:
        Conflict: A job was resumed or a study opened meanwhile, so that some calls may not go.
    """
    keys = list(find_removable(before).order_by("pk").values_list("pk", flat=True))
    images = images_named_by(keys)
    counts = {"older_than": before.isoformat(), "calls": len(keys)}
    log_event(actor=actor, verb="prune", object_kind="calls", object_code="all", after=counts)
    for start in range(0, len(keys), BATCH):
        _empty(keys[start : start + BATCH], before=before, now=now)
        yield min(start + BATCH, len(keys)), len(keys)
    delete_unnamed(images)


@transaction.atomic
def _empty(keys: list[int], *, before: datetime, now: datetime) -> None:
    """Remove messages and answers of a batch, locked so that no job is resumed meanwhile."""
    rows = list(ModelCall.objects.select_for_update().filter(pk__in=keys).order_by("pk"))
    if find_removable(before).filter(pk__in=keys).count() != len(keys):
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


# --- Rules of rows that a backup or a study's folder brings -------------------------------------

REFUSALS = (AugmentError, ValidationError, ValueError, KeyError, TypeError)
"""What a rule raises."""


def check_row(row: models.Model) -> None:
    """Refuse a row that no form and no operation of the API would have stored.

    Raises:
        One of REFUSALS: With the column and what is allowed.
    """
    match row:
        case Study():
            one_line("name", row.name, what="study")
            check_seed(row.seed)
            if row.rules:  # those of imported votes have none
                rules_of(row)
        case Matchup():
            for name in ("original_image", "left_image", "right_image"):
                check_picture_name(name, getattr(row, name))
        case Vote():
            decision_of(
                matchup_code=uuid4(),
                key=row.key,
                outcome=row.outcome,
                both_miss=row.both_miss,
                reason=row.reason,
                comment=row.comment,
                aids=row.aids.split(),
            )
        case Report():
            check_complaint(_complaint_of(row))
        case Snapshot():
            check_seed(row.seed)
            Method(row.method)
            Unit(row.resampling_unit)
            Intervals(row.intervals)
        case FaultLabel() if len(row.note) > NOTE_LENGTH:
            raise ValueError(f"note: at most {NOTE_LENGTH} characters are allowed")
        case _ if rule := row_rules.RULES.get(type(row)):
            rule(row)


def _complaint_of(row: Report) -> Complaint:
    side = row.side or Report.Side.BOTH  # reports from before it was asked name none
    return Complaint(reason=row.reason, side=side, comment=row.comment)


def check_votes() -> None:
    """Compare stored pairs and votes with each other.

    Raises:
        ArenaError: A vote is not on what its expert was shown, or a pair is not of its scenario.
    """
    votes = Vote.objects.order_by("pk")
    strangers = votes.exclude(
        expert=F("matchup__expert"), shown_left=F("matchup__left"), shown_right=F("matchup__right")
    ) | votes.exclude(supersedes=None).exclude(supersedes__matchup=F("matchup"))
    if vote := strangers.first():
        raise ArenaError(f"arena.vote, row {vote.pk}: it is not on what its expert was shown.")
    pairs = Matchup.objects.exclude(left__scenario=F("scenario"), right__scenario=F("scenario"))
    if pair := pairs.order_by("pk").first():
        raise ArenaError(
            f"arena.matchup, row {pair.pk}: both augmentations must be of its scenario."
        )


# --- Unfinished work ----------------------------------------------------------------------------

_WHY = "It was under way when the backup was taken. Start it again."

_WORK = [model for model in apps.get_models() if issubclass(model, Work)]

UNFINISHED: Mapping[type[models.Model], tuple[str, ...]] = {
    **{model: model.UNDER_WAY for model in _WORK},
    GenerationJob: (GenerationJob.State.RUNNING,),
    Study: (Study.State.OPEN,),
}
"""The states of each table in which something is still done with a row."""


def is_unfinished(row: models.Model) -> bool:
    """Return whether something would still be done with a row."""
    return getattr(row, "state", None) in UNFINISHED.get(type(row), ())


def end_restored_work() -> None:
    """Leave nothing for workers to pick up: jobs are paused, all else has failed.

    An admin resumes the jobs and asks for the rest again; studies stay open.
    """
    waiting = Augmentation.objects.filter(state__in=Augmentation.UNDER_WAY)
    jobs = GenerationJob.objects.exclude(state=GenerationJob.State.CANCELLED)
    jobs.filter(pk__in=waiting.values("job")).update(state=GenerationJob.State.PAUSED)
    for model in _WORK:
        ended = {"state": FAILED, "reason": _WHY}
        if model is Augmentation:  # it waits in a job that is paused
            ended = {"state": Augmentation.State.QUEUED}
        rows = model._default_manager.filter(state__in=model.UNDER_WAY)
        rows.update(claim=None, heartbeat_at=None, sent_at=None, **ended)
