"""The three questions of every vote, asked in SQL.

Thousands of votes ask them, and building these queries anew for each of them cost more than half
of a vote. The same text runs on SQLite and on PostgreSQL.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from django.contrib.auth.models import User
from django.db import connection
from django.db.models import Count, Q, QuerySet
from django.utils import timezone

from arena.errors import NotYours
from arena.models import Matchup, Study, Vote
from arena.queries.people import by_pseudonym
from arena.queries.plain import instances
from arena.queries.remembering import Remembered, plan_and_votes
from augment.models import Scenario

LONGEST_LOOK_MS = 60_000
"""A pair that stayed on screen longer counts as this long in the pace: the expert was away."""

PACE_VOTES = 20
"""So many latest votes make the pace."""

_HOLD = """
SELECT matchup.id, matchup.study_id, matchup.left_id, matchup.right_id,
       COALESCE(person.is_simulated, FALSE)
FROM arena_matchup matchup
LEFT JOIN arena_person person ON person.user_id = matchup.expert_id
WHERE matchup.code = %(code)s AND matchup.expert_id = %(expert)s
  AND NOT EXISTS (
    SELECT 1 FROM arena_earlylook look
    WHERE look.study_id = matchup.study_id AND look.user_id = matchup.expert_id
  )
"""

_STUDY = (
    *("id", "code", "name", "state", "allow_both_miss", "allow_text", "allow_replay"),
    "allow_measures",
    "votes_to_plan",
)
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

_MATCHUP = (
    *("id", "code", "study_id", "expert_id", "scenario_id", "position", "kind", "view"),
    *("served_at", "left_token", "right_token", "original_token", "original_image"),
    "descriptions",
)
_COMING = """
SELECT matchup.id, matchup.code, matchup.study_id, matchup.expert_id, matchup.scenario_id,
       matchup.position, matchup.kind, matchup.view, matchup.served_at, matchup.left_token,
       matchup.right_token, matchup.original_token, matchup.original_image, matchup.descriptions,
       scenario.instruction
FROM arena_matchup matchup
JOIN augment_scenario scenario ON scenario.id = matchup.scenario_id
WHERE matchup.study_id = %(study)s AND matchup.expert_id = %(expert)s
  AND NOT EXISTS (SELECT 1 FROM arena_vote vote WHERE vote.matchup_id = matchup.id)
ORDER BY matchup.position
LIMIT %(n)s
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldMatchup:
    """What storing a vote needs of its matchup.

    Attributes:
        is_simulated: Its expert is the machine.
    """

    pk: int
    study_id: int
    left_id: int
    right_id: int
    is_simulated: bool


def held_matchup(*, code: UUID, expert_pk: int) -> HeldMatchup | None:
    """The expert's matchup, its row locked until the transaction ends.

    Nothing where it is somebody else's, does not exist, or the expert has opened the results of
    its study. SQLite needs no lock: its transactions write one after the other.
    """
    lock = ""
    if connection.features.has_select_for_update:
        lock = connection.ops.for_update_sql(of=("matchup",))
    field = Matchup._meta.get_field("code")
    with connection.cursor() as cursor:
        cursor.execute(
            _HOLD + lock, {"code": field.get_db_prep_value(code, connection), "expert": expert_pk}
        )
        row = cursor.fetchone()
    if row is None:
        return None
    pk, study, left, right, simulated = row
    return HeldMatchup(
        pk=pk, study_id=study, left_id=left, right_id=right, is_simulated=bool(simulated)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyNow:
    """A study and one expert in it.

    Attributes:
        study: With what `_STUDY` names; the rest is loaded when somebody asks for it.
        total: Matchups that are planned for the expert.
        voted: Those with a vote; `skipped` those that were skipped instead.
        just_now: Votes of the expert's account since the moment that was asked for.
        pace_ms: How long the latest pairs were on screen on average, None before any.
    """

    study: Study
    total: int
    voted: int
    skipped: int
    just_now: int
    pace_ms: float | None


def study_now(*, study_pk: int, expert_pk: int, since: datetime) -> StudyNow:
    """How far an expert is in a study.

    Args:
        study_pk: Of a study that exists.
        expert_pk: Whose matchups and votes are counted.
        since: Votes after this moment are counted by `just_now`, of whatever study.
    """
    values = {
        "study": study_pk,
        "expert": expert_pk,
        "since": connection.ops.adapt_datetimefield_value(since),
        "longest": LONGEST_LOOK_MS,
        "votes": PACE_VOTES,
    }
    ((study, counts),) = instances(Study, _STUDY, _STATE, values)
    total, decided, skipped, just_now, pace_ms = counts
    return StudyNow(
        study=study,
        total=total,
        voted=decided - skipped,
        skipped=skipped,
        just_now=just_now,
        pace_ms=None if pace_ms is None else float(pace_ms),
    )


def upcoming(*, study: Study, expert: User, n: int) -> list[Matchup]:
    """The next matchups of this expert, at most n, with what a browser needs of them."""
    values = {"study": study.pk, "expert": expert.pk, "n": n}
    matchups = []
    for matchup, (instruction,) in instances(Matchup, _MATCHUP, _COMING, values):
        shown = (matchup.scenario_id, instruction)
        matchup.scenario = Scenario.from_db(connection.alias, ("id", "instruction"), shown)
        matchups.append(matchup)
    return matchups


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
