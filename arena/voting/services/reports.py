"""Experts' reports of problems; none changes a vote."""

from dataclasses import dataclass
from uuid import UUID

from django.contrib.auth.models import User
from django.db import IntegrityError

from arena.errors import InvalidVote, NotYours
from arena.models import Report
from arena.voting.queries.ballots import own_matchup, require_open
from arena.voting.services.casting import LONGEST_COMMENT
from augment.errors import Conflict
from augment.services import make_storable

MOST_REPORTS = 10
SIDES = {"A": Report.Side.LEFT, "B": Report.Side.RIGHT, "both": Report.Side.BOTH}
"""What a browser says of a side: the left picture is A."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Complaint:
    """A report of an expert on a matchup.

    Attributes:
        key: Made by the browser, one per report.
        matchup: One of the expert's own.
        side: Which picture it is about, one of Report.Side.

    Raises:
        InvalidVote: Parts are unknown or too long.
    """

    key: UUID
    matchup: UUID
    reason: str
    side: str = Report.Side.BOTH
    comment: str = ""

    def __post_init__(self) -> None:
        faults = {}
        for name, allowed in (("reason", Report.Reason.values), ("side", Report.Side.values)):
            if getattr(self, name) not in allowed:
                faults[name] = f"One of these is needed: {', '.join(allowed)}."
        if len(self.comment) > LONGEST_COMMENT:
            faults["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
        if faults:
            raise InvalidVote(faults)


def report(*, expert: User, complaint: Complaint) -> Report:
    """Keep what an expert reports; the same key again is the same report.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        StudyNotOpen: The study is over.
        Conflict: The key belongs to another report, or the pair has MOST_REPORTS.
    """
    matchup = own_matchup(expert=expert, code=complaint.matchup)
    stored = Report.objects.filter(key=complaint.key).first()
    if stored is None:
        require_open(matchup.study)
        if matchup.reports.count() >= MOST_REPORTS:
            raise Conflict(f"This pair has {MOST_REPORTS} reports already.")
        values = {
            "matchup": matchup,
            "expert": expert,
            "reason": complaint.reason,
            "side": complaint.side,
            "comment": make_storable(complaint.comment.strip()),
        }
        try:
            stored, _ = Report.objects.get_or_create(key=complaint.key, defaults=values)
        except IntegrityError:  # the pair was handed over at this moment
            raise NotYours("This matchup is not yours.") from None
    content = (matchup.pk, complaint.reason, complaint.side)
    if (stored.matchup_id, stored.reason, stored.side) != content:
        raise Conflict("This key belongs to another report; make a new key for every report.")
    return stored
