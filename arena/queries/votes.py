"""What an expert has voted and votes on next. Nobody sees what is somebody else's."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Count, Q, QuerySet

from arena.errors import NotYours
from arena.models import Matchup, Study, Vote


@dataclass(frozen=True, slots=True, kw_only=True)
class VotingProgress:
    """How far an expert is.

    Attributes:
        minutes_left: At the expert's own recent pace, None before there is one.
    """

    total: int
    voted: int
    minutes_left: int | None

    @property
    def left(self) -> int:
        """Matchups without a vote."""
        return self.total - self.voted


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertTally:
    """One expert's line in an admin's overview of a study."""

    expert: User
    pseudonym: str
    is_simulated: bool
    total: int
    voted: int
    left_wins: int
    ties: int
    right_wins: int


def undecided(*, study: Study, expert: User) -> QuerySet[Matchup]:
    """The expert's matchups without a vote, in their order."""
    return (
        Matchup.objects.filter(study=study, expert=expert, votes=None)
        .select_related("scenario")
        .defer("scenario__reference")
        .order_by("position")
    )


def upcoming(*, study: Study, expert: User, n: int) -> list[Matchup]:
    """The next matchups of this expert, at most n."""
    return list(undecided(study=study, expert=expert)[:n])


def next_matchup(*, study: Study, expert: User) -> Matchup | None:
    """What the expert judges next, None when all is done."""
    return undecided(study=study, expert=expert).first()


def matchup_of(*, expert: User, code: UUID | str) -> Matchup:
    """One of the expert's own matchups.

    Raises:
        NotYours: It is somebody else's or does not exist; the text does not tell which.
    """
    found = Matchup.objects.filter(expert=expert, code=code).select_related("study", "scenario")
    matchup = found.first()
    if matchup is None:
        raise NotYours("This matchup is not yours.")
    return matchup


def current_votes(study: Study) -> QuerySet[Vote]:
    """The votes that count: those that no later vote supersedes."""
    return Vote.objects.filter(matchup__study=study, superseded_by=None)


def recent_votes(*, study: Study, expert: User, n: int = 10) -> list[Vote]:
    """The expert's last current votes, the latest matchup first."""
    found = current_votes(study).filter(expert=expert).select_related("matchup__scenario")
    return list(found.order_by("-matchup__position")[:n])


def voting_progress(*, study: Study, expert: User) -> VotingProgress:
    """How many of the expert's matchups have a vote; two queries."""
    counts = Matchup.objects.filter(study=study, expert=expert).aggregate(
        total=Count("pk", distinct=True), voted=Count("votes__matchup", distinct=True)
    )
    times = Vote.objects.filter(
        matchup__study=study, expert=expert, ms_visible__isnull=False
    ).order_by("-pk")
    recent = [ms for ms in times.values_list("ms_visible", flat=True)[:20] if ms is not None]
    left = counts["total"] - counts["voted"]
    minutes = round(median(recent) * left / 60_000) if recent else None
    return VotingProgress(total=counts["total"], voted=counts["voted"], minutes_left=minutes)


def tallies(study: Study) -> list[ExpertTally]:
    """One line per expert of the study, for analysts and admins; three queries."""
    totals = dict(
        Matchup.objects.filter(study=study)
        .values_list("expert")
        .annotate(n=Count("pk"))
        .values_list("expert", "n")
    )
    outcomes = {
        row[0]: row[1:]
        for row in current_votes(study)
        .values("expert")
        .annotate(
            left_wins=Count("pk", filter=Q(outcome="left")),
            ties=Count("pk", filter=Q(outcome="equal")),
            right_wins=Count("pk", filter=Q(outcome="right")),
        )
        .order_by()
        .values_list("expert", "left_wins", "ties", "right_wins")
    }
    lines = []
    for expert in study.experts.select_related("person").order_by("person__pseudonym"):
        left_wins, ties, right_wins = outcomes.get(expert.pk, (0, 0, 0))
        lines.append(
            ExpertTally(
                expert=expert,
                pseudonym=expert.person.pseudonym,
                is_simulated=expert.person.is_simulated,
                total=totals.get(expert.pk, 0),
                voted=left_wins + ties + right_wins,
                left_wins=left_wins,
                ties=ties,
                right_wins=right_wins,
            )
        )
    return lines


def votes_saved(*, study: Study, expert: User) -> int:
    """How many of the expert's matchups of this study have a vote."""
    return Vote.objects.filter(matchup__study=study, expert=expert, supersedes=None).count()
