"""What experts report about a pair; it changes neither the pair nor a vote."""

from __future__ import annotations

from dataclasses import dataclass
from uuid import UUID

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction

from arena.errors import InvalidVote, NotYours, StudyNotOpen
from arena.models import Matchup, Report, Study
from arena.voting.queries.ballots import matchup_of
from arena.voting.services.casting import LONGEST_COMMENT
from augment.errors import Conflict
from augment.services.texts import make_storable

SIDES = {"A": Report.Side.LEFT, "B": Report.Side.RIGHT, "both": Report.Side.BOTH}
"""What a browser says of a side: the left picture is A."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Complaint:
    """What an expert reports.

    Attributes:
        reason: One of Report.Reason.
        side: One of Report.Side.
        mark: A place in the named pictures, as shares of their width and height from the upper
            left corner; None without one.
        comment: What is wrong.
    """

    reason: str
    side: str = Report.Side.BOTH
    mark: tuple[float, float] | None = None
    comment: str = ""


def report(*, expert: User, matchup_code: UUID | str, key: UUID, said: Complaint) -> Report:
    """Keep what an expert reports; the same key again is the same report.

    Args:
        expert: Whose report it is.
        matchup_code: What it is about; one of the expert's own matchups.
        key: Made by the browser, one per report.
        said: What is wrong, and where.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        InvalidVote: Reason or side are unknown, the mark lies beside the pictures, or the comment
            is too long.
        StudyNotOpen: The study is over.
        Conflict: The key belongs to another report.
    """
    check_complaint(said)
    matchup = matchup_of(expert=expert, code=matchup_code)
    stored = Report.objects.filter(key=key).first()
    if stored is None:
        if matchup.study.state != Study.State.OPEN:
            raise StudyNotOpen(f"The study {matchup.study.name!r} is {matchup.study.state}.")
        stored = _insert(matchup, expert, key, said)
    same = (matchup.pk, said.reason, said.side)
    if (stored.matchup_id, stored.reason, stored.side) != same:
        raise Conflict("This key belongs to another report; make a new key for every report.")
    return stored


def check_complaint(said: Complaint) -> None:
    """Refuse parts that are unknown or too long, with an InvalidVote."""
    wrong = {}
    if said.reason not in Report.Reason.values:
        wrong["reason"] = f"One of these is needed: {', '.join(Report.Reason.values)}."
    if said.side not in Report.Side.values:
        wrong["side"] = f"One of these is needed: {', '.join(Report.Side.values)}."
    if said.mark is not None and not all(0 <= share <= 1 for share in said.mark):
        wrong["mark"] = "Both numbers of a mark lie between 0 and 1."
    if len(said.comment) > LONGEST_COMMENT:
        wrong["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
    if wrong:
        raise InvalidVote(wrong)


def _insert(matchup: Matchup, expert: User, key: UUID, said: Complaint) -> Report:
    across, down = said.mark or (None, None)
    try:
        with transaction.atomic():
            return Report.objects.create(
                key=key,
                matchup=matchup,
                expert=expert,
                reason=said.reason,
                side=said.side,
                mark_x=across,
                mark_y=down,
                comment=make_storable(said.comment.strip()),
            )
    except IntegrityError:
        same = Report.objects.filter(key=key).first()
        if same is None:  # the pair was handed over at this moment
            raise NotYours("This matchup is not yours.") from None
        return same  # it arrived twice at once
