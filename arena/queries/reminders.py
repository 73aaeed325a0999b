"""Who is slow in a study: has not begun, or has fallen behind. Nothing of it is a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from math import ceil
from statistics import median

from arena.models import Study
from arena.queries.invitations import ExpertLine

GRACE = timedelta(hours=24)
"""Nobody is called slow who did something, or was asked, within so long."""

LONG_QUIET = timedelta(days=7)
"""Whoever is silent for so long is behind, however far the others are."""

FAR_BEHIND = 0.5
"""Of the median share of the others: whoever has done less of their own is behind."""


class Lag(StrEnum):
    """How somebody is slow."""

    NOT_BEGUN = "not begun"
    BEHIND = "behind"


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertPace:
    """How far an expert is.

    Attributes:
        decided: Pairs that were judged or skipped.
        due: Pairs that the study needs of them.
        quiet_since: When they were last asked, seen or heard, whichever came last.
    """

    decided: int
    due: int
    quiet_since: datetime

    @property
    def share(self) -> float:
        """Of what is due; 1 where nothing is."""
        return min(1.0, self.decided / self.due) if self.due else 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowExpert:
    """Somebody to be reminded."""

    line: ExpertLine
    lag: Lag


def lag_of(own: ExpertPace, others: Sequence[ExpertPace], *, now: datetime) -> Lag | None:
    """How an expert is slow, None for who is not.

    Args:
        own: Of the expert.
        others: Of all other experts of the study.
        now: The moment that silence is counted to.
    """
    quiet = now - own.quiet_since
    if own.decided >= own.due or quiet < GRACE:
        return None
    if own.decided == 0:
        return Lag.NOT_BEGUN
    if quiet >= LONG_QUIET:
        return Lag.BEHIND
    usual = median(pace.share for pace in others) if others else 0.0
    return Lag.BEHIND if own.share < FAR_BEHIND * usual else None


def pairs_due(total: int, *, experts: int, stop_votes: int | None) -> int:
    """Pairs that a study needs of an expert: all planned, or their part of where it stops.

    Args:
        total: Planned for the expert.
        experts: How many share the votes.
        stop_votes: At which number of votes the study stops; None for all that are planned.
    """
    return total if stop_votes is None else min(total, ceil(stop_votes / max(experts, 1)))


def slow_experts(study: Study, lines: Sequence[ExpertLine], now: datetime) -> list[SlowExpert]:
    """The slow experts of an open study who can be sent a link, in the order of the lines."""
    if study.state != Study.State.OPEN:
        return []
    people = [line for line in lines if not line.tally.is_simulated]
    stop_votes = (study.rules.get("stopping") or {}).get("votes")
    paces = [
        ExpertPace(
            decided=line.tally.voted + line.tally.skips,
            due=pairs_due(line.tally.total, experts=len(people), stop_votes=stop_votes),
            quiet_since=_quiet_since(study, line, now),
        )
        for line in people
    ]
    found = []
    for place, line in enumerate(people):
        lag = lag_of(paces[place], paces[:place] + paces[place + 1 :], now=now)
        if lag is not None and line.may_be_invited:
            found.append(SlowExpert(line=line, lag=lag))
    return found


def _quiet_since(study: Study, line: ExpertLine, now: datetime) -> datetime:
    asked = line.invitation.made_at if line.invitation else None
    return max(
        (at for at in (study.opened_at, asked, line.last_seen) if at is not None), default=now
    )
