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

from arena.models import Matchup, Study
from arena.queries.plain import instances
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
