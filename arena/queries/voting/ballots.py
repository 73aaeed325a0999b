"""What an expert has voted and votes on next. Nobody sees what is somebody else's."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Count, Q, QuerySet
from django.utils import timezone

from arena.errors import NotYours
from arena.models import Matchup, Study, Vote
from arena.people.queries import by_pseudonym
from arena.queries.remembering import Remembered, plan_and_votes
from arena.queries.voting.path import study_now


@dataclass(frozen=True, slots=True, kw_only=True)
class VotingProgress:
    """How far an expert is.

    Attributes:
        voted: Matchups with a vote; `skipped` those that were skipped instead.
        pace_ms: How long the expert's latest pairs were on screen on average, None before any.
    """

    total: int
    voted: int
    skipped: int
    pace_ms: float | None

    @property
    def left(self) -> int:
        """Matchups that still wait for a decision."""
        return self.total - self.voted - self.skipped

    @property
    def minutes_left(self) -> int | None:
        """At the expert's own recent pace, None before there is one."""
        return None if self.pace_ms is None else round(self.pace_ms * self.left / 60_000)


@dataclass(frozen=True, slots=True, kw_only=True)
class VotingState:
    """What a vote needs to know of its study, read anew.

    Attributes:
        study: Name, code, state and what it allows; nothing else is loaded.
        just_now: Votes of the expert's account since the moment that was asked for.
    """

    study: Study
    progress: VotingProgress
    just_now: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertTally:
    """One expert's line in an admin's overview of a study.

    Attributes:
        voted: Matchups with a vote; skips are none.
    """

    expert: User
    pseudonym: str
    is_simulated: bool
    total: int
    voted: int
    left_wins: int
    ties: int
    right_wins: int
    skips: int

    @property
    def left(self) -> int:
        """Matchups that still wait for a decision."""
        return self.total - self.voted - self.skips


def matchup_of(*, expert: User, code: UUID | str) -> Matchup:
    """One of the expert's own matchups.

    Raises:
        NotYours: It is somebody else's or does not exist; the text does not tell which.
    """
    matchups = Matchup.objects.filter(expert=expert, code=code).select_related("study", "scenario")
    matchup = matchups.first()
    if matchup is None:
        raise NotYours("This matchup is not yours.")
    return matchup


def current_votes(study: Study) -> QuerySet[Vote]:
    """What experts have decided: the votes that no later vote supersedes, of every kind."""
    return Vote.objects.filter(matchup__study=study, superseded_by=None)


def recent_votes(*, study: Study, expert: User, n: int = 10) -> list[Vote]:
    """The expert's last current votes, the latest matchup first."""
    votes = current_votes(study).filter(expert=expert).select_related("matchup__scenario")
    votes = votes.defer("matchup__scenario__reference")
    return list(votes.order_by("-matchup__position")[:n])


def skipped_pairs(*, study: Study, expert: User) -> list[Vote]:
    """The expert's skips that count, by the place of their pairs; each can be voted on still."""
    skips = current_votes(study).filter(expert=expert, outcome=Vote.Outcome.SKIP)
    found = skips.select_related("matchup__scenario").defer("matchup__scenario__reference")
    return list(found.order_by("matchup__position"))


def skip_of(*, study: Study, expert: User, key: str) -> Vote | None:
    """The expert's skip of that key, None where it counts no longer or the key is none."""
    try:
        asked = UUID(key)
    except ValueError:
        return None
    skips = current_votes(study).filter(expert=expert, outcome=Vote.Outcome.SKIP)
    return skips.filter(key=asked).select_related("matchup__scenario").first()


def voting_progress(*, study: Study, expert: User) -> VotingProgress:
    """How many of the expert's matchups have a vote, and how many were skipped; one query."""
    return voting_state(study_pk=study.pk, expert=expert, since=timezone.now()).progress


def voting_state(*, study_pk: int, expert: User, since: datetime) -> VotingState:
    """The study and how far the expert is in it, as they are now; one query.

    Args:
        study_pk: Of a study that exists.
        expert: Whose matchups and votes are counted.
        since: Votes after this moment count as given just now, of whatever study.
    """
    now = study_now(study_pk=study_pk, expert_pk=expert.pk, since=since)
    total = now.total + now.study.votes_to_plan.get(expert.username, 0)
    progress = VotingProgress(
        total=total, voted=now.voted, skipped=now.skipped, pace_ms=now.pace_ms
    )
    return VotingState(study=now.study, progress=progress, just_now=now.just_now)


def tallies(study: Study) -> list[ExpertTally]:
    """One line per expert of the study, for analysts and admins; six queries at most."""
    totals, outcomes = _TALLIED.get(plan_and_votes(study), lambda: _tally(study))
    lines = []
    experts = study.experts.select_related("person").prefetch_related("groups")
    for expert in by_pseudonym(experts):
        counts = outcomes.get(expert.pk, (0, 0, 0, 0))
        lines.append(
            ExpertTally(
                expert=expert,
                pseudonym=expert.person.pseudonym,
                is_simulated=expert.person.is_simulated,
                total=totals.get(expert.pk, 0) + study.votes_to_plan.get(expert.username, 0),
                voted=sum(counts[:3]),
                left_wins=counts[0],
                ties=counts[1],
                right_wins=counts[2],
                skips=counts[3],
            )
        )
    return lines


def _tally(study: Study) -> tuple[dict[int, int], dict[int, tuple[int, int, int, int]]]:
    """By expert: the matchups, and the current votes to the left, equal, to the right, skipped."""
    totals = dict(
        Matchup.objects.filter(study=study)
        .values_list("expert")
        .annotate(n=Count("pk"))
        .values_list("expert", "n")
    )
    outcomes = {
        expert: (left_wins, ties, right_wins, skips)
        for expert, left_wins, ties, right_wins, skips in current_votes(study)
        .values("expert")
        .annotate(
            left_wins=Count("pk", filter=Q(outcome="left")),
            ties=Count("pk", filter=Q(outcome="equal")),
            right_wins=Count("pk", filter=Q(outcome="right")),
            skips=Count("pk", filter=Q(outcome="skip")),
        )
        .order_by()
        .values_list("expert", "left_wins", "ties", "right_wins", "skips")
    }
    return totals, outcomes


_TALLIED: Remembered[tuple[dict[int, int], dict[int, tuple[int, int, int, int]]]] = Remembered(8)
