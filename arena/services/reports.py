"""What experts report about a pair; it changes neither the pair nor a vote."""

from __future__ import annotations

from uuid import UUID

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction

from arena.errors import InvalidVote, NotYours, StudyNotOpen
from arena.models import Matchup, Report, Study
from arena.queries.votes import matchup_of
from arena.services.decisions import LONGEST_COMMENT
from augment.errors import Conflict
from augment.services.texts import make_storable


def report(
    *, expert: User, matchup_code: UUID | str, key: UUID, reason: str, comment: str = ""
) -> Report:
    """Keep what an expert reports; the same key again is the same report.

    Args:
        expert: Whose report it is.
        matchup_code: What it is about; one of the expert's own matchups.
        key: Made by the browser, one per report.
        reason: One of Report.Reason.
        comment: What is wrong.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        InvalidVote: The reason is unknown, or the comment too long.
        StudyNotOpen: The study is over.
        Conflict: The key belongs to another report.
    """
    _check(reason, comment)
    matchup = matchup_of(expert=expert, code=matchup_code)
    stored = Report.objects.filter(key=key).first()
    if stored is None:
        if matchup.study.state != Study.State.OPEN:
            raise StudyNotOpen(f"The study {matchup.study.name!r} is {matchup.study.state}.")
        stored = _insert(matchup, expert, key, reason, make_storable(comment.strip()))
    if (stored.matchup_id, stored.reason) != (matchup.pk, reason):
        raise Conflict("This key belongs to another report; make a new key for every report.")
    return stored


def _check(reason: str, comment: str) -> None:
    wrong = {}
    if reason not in Report.Reason.values:
        wrong["reason"] = f"One of these is needed: {', '.join(Report.Reason.values)}."
    if len(comment) > LONGEST_COMMENT:
        wrong["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
    if wrong:
        raise InvalidVote(wrong)


def _insert(matchup: Matchup, expert: User, key: UUID, reason: str, comment: str) -> Report:
    try:
        with transaction.atomic():
            return Report.objects.create(
                key=key, matchup=matchup, expert=expert, reason=reason, comment=comment
            )
    except IntegrityError:
        same = Report.objects.filter(key=key).first()
        if same is None:  # the pair was handed over at this moment
            raise NotYours("This matchup is not yours.") from None
        return same  # it arrived twice at once
