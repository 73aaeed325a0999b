"""What an expert has voted and votes on next. Nobody sees what is somebody else's."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.db import connection
from django.db.models import BooleanField, Count, F, Q, QuerySet
from django.db.models.functions import Coalesce
from django.utils import timezone

from arena.errors import NotYours
from arena.models import Matchup, Study, Vote
from arena.people.queries import by_pseudonym
from arena.voting.queries.remembering import Remembered, plan_and_votes

LONGEST_LOOK_MS = 60_000
"""A pair that stayed on screen longer counts as this long in the pace: the expert was away."""

PACE_VOTES = 20
"""So many latest votes make the pace."""


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
        study: Name, code, state and what it allows; the rest is loaded when asked for.
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


def hold_matchup(*, expert: User, code: UUID) -> Matchup:
    """The expert's matchup, its row locked until the transaction ends; see `by_machine`.

    The lock makes two votes on one matchup wait for each other, and the closing of the study for
    both. Who has opened the study's results votes in it no longer.

    Raises:
        NotYours: It is somebody else's, does not exist, or is closed to the expert.
    """
    rows = Matchup.objects.select_for_update(of=("self",)).filter(code=code, expert=expert)
    machine = Coalesce(F("expert__person__is_simulated"), False, output_field=BooleanField())
    held = (
        rows.exclude(study__early_looks__user=expert)
        .annotate(by_machine=machine)
        .select_related("study")
        .only("study__name", "study__state", "left", "right")
        .first()
    )
    if held is None:
        raise NotYours("This matchup is not yours.")
    return held


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
    return list(_skips(study, expert).order_by("matchup__position"))


def skip_of(*, study: Study, expert: User, key: str) -> Vote | None:
    """The expert's skip of that key, None where it counts no longer or the key is none."""
    try:
        return _skips(study, expert).filter(key=UUID(key)).first()
    except ValueError:
        return None


def upcoming(*, study: Study, expert: User, n: int) -> list[Matchup]:
    """The next matchups of this expert, at most n, with what a browser needs of them."""
    rows = Matchup.objects.filter(study=study, expert=expert, votes=None).select_related(
        "scenario"
    )
    needed = (
        *("code", "study_id", "expert_id", "position", "kind", "view", "served_at"),
        *("left_token", "right_token", "original_token", "original_image", "descriptions"),
        "scenario__instruction",
    )
    return list(rows.select_related("scenario").only(*needed).order_by("position")[:n])


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
    values = {
        "study": study_pk,
        "expert": expert.pk,
        "since": connection.ops.adapt_datetimefield_value(since),
        "longest": LONGEST_LOOK_MS,
        "votes": PACE_VOTES,
    }
    row: Any = Study.objects.raw(_STATE, values)[0]  # with the counts as attributes
    progress = VotingProgress(
        total=row.total + row.votes_to_plan.get(expert.username, 0),
        voted=row.decided - row.skipped,
        skipped=row.skipped,
        pace_ms=None if row.pace_ms is None else float(row.pace_ms),
    )
    return VotingState(study=row, progress=progress, just_now=row.just_now)


def tallies(study: Study) -> list[ExpertTally]:
    """One line per expert of the study, for analysts and admins; six queries at most."""
    totals, outcomes = _TALLIED.get(plan_and_votes(study), lambda: _tally(study))
    lines = []
    experts = study.experts.select_related("person").prefetch_related("groups")
    for expert in by_pseudonym(experts):
        left_wins, ties, right_wins, skips = outcomes.get(expert.pk, (0, 0, 0, 0))
        lines.append(
            ExpertTally(
                expert=expert,
                pseudonym=expert.person.pseudonym,
                is_simulated=expert.person.is_simulated,
                total=totals.get(expert.pk, 0) + study.votes_to_plan.get(expert.username, 0),
                voted=left_wins + ties + right_wins,
                left_wins=left_wins,
                ties=ties,
                right_wins=right_wins,
                skips=skips,
            )
        )
    return lines


# --- Private -----------------------------------------------------------------------------------

_Tally = tuple[dict[int, int], dict[int, tuple[int, int, int, int]]]
_TALLIED: Remembered[_Tally] = Remembered(8)

# Thousands of votes ask this, and building the query anew cost as much as asking it.
_STATE = """
SELECT study.id, study.code, study.name, study.state, study.allow_both_miss, study.allow_text,
       study.allow_replay, study.allow_measures, study.votes_to_plan,
       (SELECT COUNT(*) FROM arena_matchup matchup
        WHERE matchup.study_id = study.id AND matchup.expert_id = %(expert)s) AS total,
       (SELECT COUNT(*) FROM arena_vote vote
        JOIN arena_matchup matchup ON matchup.id = vote.matchup_id
        WHERE matchup.study_id = study.id AND vote.expert_id = %(expert)s
          AND vote.supersedes_id IS NULL) AS decided,
       (SELECT COUNT(*) FROM arena_vote vote
        JOIN arena_matchup matchup ON matchup.id = vote.matchup_id
        WHERE matchup.study_id = study.id AND vote.expert_id = %(expert)s
          AND vote.outcome = 'skip' AND NOT EXISTS (
            SELECT 1 FROM arena_vote later WHERE later.supersedes_id = vote.id)) AS skipped,
       (SELECT COUNT(*) FROM arena_vote vote
        WHERE vote.expert_id = %(expert)s AND vote.at > %(since)s) AS just_now,
       (SELECT AVG(CASE WHEN latest.ms_visible > %(longest)s THEN %(longest)s
                        ELSE latest.ms_visible END)
        FROM (SELECT vote.ms_visible FROM arena_vote vote
              JOIN arena_matchup matchup ON matchup.id = vote.matchup_id
              WHERE matchup.study_id = %(study)s AND vote.expert_id = %(expert)s
                AND vote.ms_visible IS NOT NULL
              ORDER BY vote.id DESC LIMIT %(votes)s) latest) AS pace_ms
FROM arena_study study
WHERE study.id = %(study)s
"""


def _skips(study: Study, expert: User) -> QuerySet[Vote]:
    skips = current_votes(study).filter(expert=expert, outcome=Vote.Outcome.SKIP)
    return skips.select_related("matchup__scenario").defer("matchup__scenario__reference")


def _tally(study: Study) -> _Tally:
    """By expert: the matchups, and the current votes to the left, equal, to the right, skipped."""
    totals = Matchup.objects.filter(study=study).order_by().values_list("expert")
    outcomes = ("left", "equal", "right", "skip")
    counts = {name: Count("pk", filter=Q(outcome=name)) for name in outcomes}
    votes = current_votes(study).order_by().values_list("expert").annotate(**counts)
    return (
        dict(totals.annotate(n=Count("pk"))),
        {expert: (left, ties, right, skips) for expert, left, ties, right, skips in votes},
    )
