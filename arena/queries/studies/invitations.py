"""Who was invited, and how far the experts of a study are."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime
from statistics import median

from django.contrib.auth.models import User

from arena.errors import NotYours
from arena.models import Invitation, Study, Vote, token_digest
from arena.queries.people import role_of
from arena.queries.remembering import Remembered, plan_and_votes
from arena.voting.queries.ballots import ExpertTally, tallies


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertLine:
    """One expert of a study, for the people who run it.

    Attributes:
        seconds_per_vote: Median time that a pair was on screen, None before it was measured.
        last_seen: The last vote in this study or the last sign-in, whichever is later.
        invitation: The newest link, None if there never was one.
        link: Its state, None without one.
        may_be_invited: Whether a link may be made for this account.
    """

    tally: ExpertTally
    seconds_per_vote: float | None
    last_seen: datetime | None
    invitation: Invitation | None
    link: Invitation.State | None
    may_be_invited: bool

    @property
    def has_live_link(self) -> bool:
        """Whether somebody can come in by the newest link."""
        return self.link in Invitation.ALIVE

    @property
    def left(self) -> int:
        """Planned matchups without a vote."""
        return self.tally.left


def may_be_let_in(user: User) -> bool:
    """Whether a link may sign this account in: an active expert, nothing more, no machine."""
    return role_of(user) == "expert" and not user.person.is_simulated


def invitation_by_token(token: str, *, locked: bool = False) -> Invitation:
    """The invitation whose link carries this token, whatever its state.

    Raises:
        NotYours: There is none.
    """
    rows = Invitation.objects.select_related("study", "expert__person", "invited_by")
    if locked:
        rows = rows.select_for_update(of=("self",))
    invitation = rows.filter(token_sha256=token_digest(token)).first()
    if invitation is None:
        raise NotYours("No invitation has this address.")
    return invitation


def expert_lines(study: Study, now: datetime) -> list[ExpertLine]:
    """One line per expert of the study, by pseudonym; so many queries whatever their number.

    Args:
        study: Any, also a closed one.
        now: For the states of the links.
    """
    pace, last_vote = _PACED.get(plan_and_votes(study), lambda: _pace(study))
    newest = {
        row.expert_id: row
        for row in study.invitations.select_related("invited_by").order_by("made_at", "pk")
    }
    lines = []
    for tally in tallies(study):
        user = tally.expert
        seen = [at for at in (last_vote.get(user.pk), user.last_login) if at is not None]
        invitation = newest.get(user.pk)
        lines.append(
            ExpertLine(
                tally=tally,
                seconds_per_vote=pace.get(user.pk),
                last_seen=max(seen, default=None),
                invitation=invitation,
                link=invitation.state(now) if invitation else None,
                may_be_invited=study.state != Study.State.CANCELLED and may_be_let_in(user),
            )
        )
    return lines


# --- Private -----------------------------------------------------------------------------------


def _pace(study: Study) -> tuple[dict[int, float], dict[int, datetime]]:
    """By expert: the median of the seconds per vote, skips apart, and the moment of the last."""
    shown: dict[int, list[int]] = defaultdict(list)
    last: dict[int, datetime] = {}
    votes = Vote.objects.filter(matchup__study=study)
    for expert, outcome, ms_visible, at in votes.values_list(
        "expert", "outcome", "ms_visible", "at"
    ).iterator(chunk_size=5000):
        last[expert] = max(at, last.get(expert, at))
        if ms_visible is not None and outcome != Vote.Outcome.SKIP:
            shown[expert].append(ms_visible)
    return {expert: median(times) / 1000 for expert, times in shown.items()}, last


_PACED: Remembered[tuple[dict[int, float], dict[int, datetime]]] = Remembered(8)
