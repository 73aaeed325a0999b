"""Rows that a backup or a study's folder brings: checked, and what was under way in them ended."""

from collections.abc import Mapping
from uuid import uuid4

from django.apps import apps
from django.core.exceptions import ValidationError
from django.db import models
from django.db.models import F

from arena.errors import ArenaError
from arena.jobs.services import NOTE_LENGTH
from arena.models import FaultLabel, Matchup, Report, Snapshot, Study, Vote
from arena.rating.rules import Intervals, Method, Unit
from arena.studies.services.opening import check_questions, check_seed
from arena.studies.services.planning import frozen_rules
from arena.voting.services.casting import Decision, FaultMark
from arena.voting.services.reports import Complaint
from augment.errors import AugmentError
from augment.models import FAILED, Augmentation, GenerationJob, Work
from augment.services import check_picture_name, one_line, row_rules

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
            check_questions(row.questions)
            if row.rules:  # those of imported votes have none
                frozen_rules(row)
        case Matchup():
            for name in ("original_image", "left_image", "right_image"):
                check_picture_name(name, getattr(row, name))
        case Vote():
            Decision(
                key=row.key,
                matchup=uuid4(),
                outcome=row.outcome,
                both_miss=row.both_miss,
                strength=row.strength,
                reason=row.reason,
                comment=row.comment,
                aids=row.aids.split(),
                faults=[
                    FaultMark(side, place, str(fault))
                    for place, (side, _object, fault) in enumerate(row.faults)
                ],
            )
        case Report():
            side = row.side or Report.Side.BOTH  # reports from before it was asked name none
            Complaint(
                key=row.key, matchup=uuid4(), reason=row.reason, side=side, comment=row.comment
            )
        case Snapshot():
            check_seed(row.seed)
            Method(row.method)
            Unit(row.resampling_unit)
            Intervals(row.intervals)
        case FaultLabel() if len(row.note) > NOTE_LENGTH:
            raise ValueError(f"note: at most {NOTE_LENGTH} characters are allowed")
        case _ if rule := row_rules.RULES.get(type(row)):
            rule(row)


def check_votes() -> None:
    """Compare stored pairs and votes with each other.

    Raises:
        ArenaError: A vote is not on what its expert was shown, or a pair is not of its scenario.
    """
    votes = Vote.objects.order_by("pk")
    strangers = votes.exclude(
        expert=F("matchup__expert"), shown_left=F("matchup__left"), shown_right=F("matchup__right")
    ) | votes.exclude(supersedes=None).exclude(
        supersedes__matchup=F("matchup"), supersedes__question=F("question")
    )
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
