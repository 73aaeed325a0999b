"""The rules of augment.services.row_rules for all tables, and for what rows say of each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any
from uuid import uuid4

from django.core.exceptions import ValidationError
from django.db import models
from django.db.models import F

from arena.errors import ArenaError
from arena.jobs.services import NOTE_LENGTH
from arena.models import FaultLabel, Matchup, Report, Snapshot, Study, Vote
from arena.rating.bootstrap import Unit
from arena.rating.rules import Intervals, Method
from arena.services.decisions import decision_of
from arena.services.plans import rules_of
from arena.services.reports import Complaint, check_complaint
from arena.services.studies import check_seed
from augment.errors import AugmentError
from augment.services import row_rules
from augment.services.texts import check_picture_name, one_line

REFUSALS = (AugmentError, ArenaError, ValidationError, ValueError, KeyError, TypeError)
"""What a rule raises."""


def check_row(row: models.Model) -> None:
    """Refuse a row that no form and no door of the API would have stored.

    Raises:
        One of REFUSALS: With the column and what is allowed.
    """
    if rule := _RULES.get(type(row)):
        rule(row)


def check_votes() -> None:
    """Hold stored pairs and votes against each other.

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


# --- Private -----------------------------------------------------------------------------------


def _check_study(row: Study) -> None:
    one_line("name", row.name, what="study")
    check_seed(row.seed)
    if row.rules:  # those of imported votes have none
        rules_of(row)


def _check_matchup(row: Matchup) -> None:
    for name in ("original_image", "left_image", "right_image"):
        check_picture_name(name, getattr(row, name))


def _check_vote(row: Vote) -> None:
    decision_of(
        matchup_code=uuid4(),
        key=row.key,
        outcome=row.outcome,
        both_miss=row.both_miss,
        reason=row.reason,
        comment=row.comment,
        aids=row.aids.split(),
    )


def _check_report(row: Report) -> None:
    mark = None if row.mark_x is None or row.mark_y is None else (row.mark_x, row.mark_y)
    side = row.side or Report.Side.BOTH  # those from before it was asked name none
    check_complaint(Complaint(reason=row.reason, side=side, mark=mark, comment=row.comment))


def _check_label(row: FaultLabel) -> None:
    if len(row.note) > NOTE_LENGTH:
        raise ValueError(f"note: at most {NOTE_LENGTH} characters are allowed")


def _check_snapshot(row: Snapshot) -> None:
    check_seed(row.seed)
    Method(row.method)
    Unit(row.resampling_unit)
    Intervals(row.intervals)


_RULES: Mapping[type[models.Model], Callable[[Any], None]] = {
    **row_rules.RULES,
    FaultLabel: _check_label,
    Matchup: _check_matchup,
    Report: _check_report,
    Snapshot: _check_snapshot,
    Study: _check_study,
    Vote: _check_vote,
}
