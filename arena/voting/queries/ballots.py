"""Past and next ballots of an expert. Nobody sees somebody else's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import takewhile
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.db import connection, models
from django.db.models.expressions import RawSQL
from django.db.models.fields import IntegerField
from django.utils import timezone

from arena.errors import NotYours, StudyNotOpen
from arena.models import EnrolledVoter, Matchup, Study, Vote
from arena.people.queries import by_pseudonym
from arena.voting.queries.showings import note_objects
from augment.services.clock import database_now


@dataclass(frozen=True, slots=True, kw_only=True)
class VotingProgress:
    """Numbers of matchups: all, with a vote, and skipped."""

    total: int
    voted: int
    skipped: int

    @property
    def left(self) -> int:
        """Matchups that still wait for a decision."""
        return self.total - self.voted - self.skipped


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertTally(VotingProgress):
    """The progress of one expert of a study."""

    expert: User


def require_open(study: Study) -> None:
    """Raise StudyNotOpen for a study that takes no votes."""
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study {study.name!r} takes no votes: it is {study.state}.")


def own_matchup(*, expert: User, code: UUID | str) -> Matchup:
    """Return one of the expert's own matchups.

    Raises:
        NotYours: It is somebody else's or does not exist; the text does not tell which.
    """
    matchups = Matchup.objects.filter(expert=expert, code=code).select_related("study", "scenario")
    matchup = matchups.first()
    if matchup is None:
        raise NotYours("This matchup is not yours.")
    return matchup


def hold_matchup(*, expert: User, code: UUID) -> Matchup:
    """Return the expert's matchup with its row locked until the transaction ends.

    The lock makes two votes on one matchup wait for each other, and the closing of the study for
    both. Who has opened the study's results votes in it no longer.

    Raises:
        NotYours: It is somebody else's, does not exist, or is closed to the expert.
    """
    rows = Matchup.objects.select_for_update(of=("self",)).select_related("study")
    needed = ("study__name", "study__state", "study__questions", "left", "right")
    try:
        return rows.only(*needed).get(_SAW_NO_RESULTS, code=code, expert=expert)
    except Matchup.DoesNotExist as error:
        raise NotYours("This matchup is not yours.") from error


def of_skipped_pair() -> models.Q:
    """Votes on pairs that are skipped whole, the skips themselves among them."""
    skips = Vote.objects.filter(outcome=Vote.Outcome.SKIP, superseded_by=None)
    return models.Q(models.Exists(skips.filter(matchup=models.OuterRef("matchup"))))


def current_votes(study: Study) -> models.QuerySet[Vote]:
    """Return the votes of a study that no later vote supersedes, of every kind."""
    return Vote.objects.filter(matchup__study=study, superseded_by=None)


def own_votes(study: Study, expert: User) -> models.QuerySet[Vote]:
    """Return an expert's current votes with what is shown of them, in the order of asking."""
    votes = current_votes(study).filter(expert=expert)
    votes = votes.select_related("matchup__scenario__follows")
    turns = [models.When(question=key, then=turn) for turn, key in enumerate(study.questions)]
    unread = "matchup__scenario__reference", "matchup__scenario__follows__reference"
    return votes.defer(*unread).order_by("matchup__position", models.Case(*turns))


def upcoming(*, study: Study, expert: User, n: int) -> list[Matchup]:
    """Return the next matchups of this expert, at most n, with what a browser needs of them.

    Each says what is `asked` next; one that is answered in part comes again. There is none of a
    study that takes no votes, and none from the first on whose pictures are still to be drawn.
    """
    if study.state != Study.State.OPEN:
        return []
    waits = RawSQL(_WAITS, (study.questions[-1],), output_field=models.BooleanField())
    matchups = _PAIRS.filter(waits, study=study, expert=expert)[:n]
    for matchup in matchups:
        matchup.asked = study.questions[matchup.answered]
    drawn: list[Matchup] = list(
        takewhile(lambda pair: pair.view is None or "px_per_m" in pair.view, matchups)
    )
    if study.ask_why:
        note_objects(drawn)
    return drawn


def find_undrawn(study: Study) -> models.QuerySet[Matchup]:
    """Return the matchups whose pictures workers have yet to draw."""
    planned = study.matchups.filter(view__isnull=False)
    return planned.exclude(view__has_key="px_per_m")


def is_being_drawn(study: Study) -> bool:
    """Return whether a worker began to draw within the last half minute."""
    now = database_now().timestamp()
    recent = find_undrawn(study).filter(view__since__gt=now - 30.0, view__since__lte=now)
    return recent.exists()


# Written out: thousands of votes ask this, and building it anew cost as much as asking it.
_SAW_NO_RESULTS = RawSQL(
    """
NOT EXISTS (
    SELECT 1 FROM arena_earlylook look
    WHERE look.study_id = arena_matchup.study_id AND look.user_id = arena_matchup.expert_id)
""",
    (),
    output_field=models.BooleanField(),
)
_SKIPS = """
(vote.outcome = 'skip' AND NOT EXISTS (
    SELECT 1 FROM arena_vote later WHERE later.supersedes_id = vote.id))
"""
# Questions are answered in their order: their number says which comes next, the last ends a pair.
_ANSWERED = """
(SELECT COUNT(DISTINCT vote.question) FROM arena_vote vote
    WHERE vote.matchup_id = arena_matchup.id)
"""
_WAITS = f"""
NOT EXISTS (
    SELECT 1 FROM arena_vote vote
    WHERE vote.matchup_id = arena_matchup.id AND (vote.question = %s OR {_SKIPS}))
"""
_PAIRS = (
    Matchup.objects.annotate(answered=RawSQL(_ANSWERED, (), output_field=IntegerField()))
    .select_related("scenario__follows")
    .only(
        *("code", "study_id", "expert_id", "position", "kind", "view"),
        *("left_token", "right_token", "original_token"),
        *("left_image", "right_image", "original_image"),
        *("scenario__instruction", "scenario__follows"),
        *("scenario__follows__instruction", "scenario__follows__follows"),
    )
    .order_by("position")
)


def voting_progress(*, study: Study, expert: User) -> VotingProgress:
    """Count the expert's matchups that have a vote or were skipped; one query."""
    return voting_state(study=study, expert=expert, since=timezone.now())[1]


def voting_state(
    *, study: Study, expert: User, since: datetime
) -> tuple[Study, VotingProgress, int]:
    """Return a study read anew, the expert's progress, and the votes since; one query.

    Args:
        study: Which; its questions never change. Columns of what is returned that are not needed
            are loaded when asked for.
        expert: Whose matchups and votes are counted.
        since: Votes of the minute after this moment are counted apart, of whatever study; a clock
            that was set back leaves later ones.
    """
    values = {
        "study": study.pk,
        "last": study.questions[-1],
        "expert": expert.pk,
        "since": connection.ops.adapt_datetimefield_value(since),
        "until": connection.ops.adapt_datetimefield_value(since + timedelta(minutes=1)),
    }
    row: Any = Study.objects.raw(_STATE, values)[0]  # with the counts as attributes
    progress = VotingProgress(
        total=row.total, voted=row.decided - row.skipped, skipped=row.skipped
    )
    return row, progress, row.just_now


# Votes have the expert of their matchup; said so, PostgreSQL reads no other expert's matchups.
_STATE = f"""
SELECT study.id, study.code, study.name, study.state, study.allow_both_miss,
       study.ask_strength, study.ask_why, study.allow_replay, study.questions,
       own.decided, own.skipped,
       (SELECT COUNT(*) FROM arena_matchup matchup
        WHERE matchup.study_id = study.id AND matchup.expert_id = %(expert)s) AS total,
       (SELECT COUNT(*) FROM arena_vote vote
        WHERE vote.expert_id = %(expert)s AND vote.at > %(since)s
        AND vote.at < %(until)s) AS just_now
FROM arena_study study, (
    SELECT COUNT(CASE WHEN {_SKIPS} THEN 1 END) AS skipped, COUNT(DISTINCT
           CASE WHEN vote.question = %(last)s OR {_SKIPS} THEN vote.matchup_id END) AS decided
    FROM arena_vote vote JOIN arena_matchup matchup
         ON matchup.id = vote.matchup_id AND matchup.expert_id = vote.expert_id
    WHERE matchup.study_id = %(study)s AND vote.expert_id = %(expert)s) own
WHERE study.id = %(study)s
"""


def count_votes(
    matchups: models.QuerySet[Matchup], by: str
) -> Callable[[int, Sequence[str]], dict[str, int]]:
    """Count matchups, and those with a vote or skipped, by their study or expert; three queries.

    Returns:
        From a key and the questions that are asked the values of a VotingProgress.
    """
    current = Vote.objects.filter(matchup__in=matchups, superseded_by=None).order_by()
    totals = dict(matchups.order_by().values_list(by).annotate(n=models.Count("pk")))
    answers = current.exclude(of_skipped_pair()).values_list(f"matchup__{by}", "question")
    voted = {(key, question): n for key, question, n in answers.annotate(n=models.Count("pk"))}
    skips = current.filter(outcome=Vote.Outcome.SKIP).values_list(f"matchup__{by}")
    skipped = dict(skips.annotate(n=models.Count("pk")))
    return lambda key, questions: {
        "total": totals.get(key, 0),
        "voted": voted.get((key, questions[-1]), 0),
        "skipped": skipped.get(key, 0),
    }


def tallies(study: Study) -> list[ExpertTally]:
    """Return one line per expert of the study, by pseudonym."""
    count = count_votes(study.matchups.all(), by="expert")
    experts = by_pseudonym(study.experts.select_related("person"))
    return [ExpertTally(expert=one, **count(one.pk, study.questions)) for one in experts]


Voters = models.QuerySet[Any]
"""Of EnrolledVoter, with what is counted about each."""


def list_voters(study: Study) -> Voters:
    """Return everybody who ever took a place in a study; one query.

    Each has `planned`, `answered` and `skipped` (pairs; a skip is an answer as well),
    `last_vote_at` and `is_done`.
    """
    mine = models.Q(expert__matchups__study=study)
    skipped = mine & models.Q(
        expert__matchups__votes__outcome="skip", expert__matchups__votes__superseded_by=None
    )
    answered = skipped | (mine & models.Q(expert__matchups__votes__question=study.questions[-1]))
    is_done = models.Q(dropped_at=None, planned__gt=0, answered__gte=models.F("planned"))
    return (
        EnrolledVoter.objects.filter(enrolment__study=study)
        .select_related("expert__person", "enrolment")
        .annotate(
            planned=models.Count("expert__matchups", filter=mine, distinct=True),
            answered=models.Count("expert__matchups", filter=answered, distinct=True),
            skipped=models.Count("expert__matchups", filter=skipped, distinct=True),
            last_vote_at=models.Max("expert__matchups__votes__at", filter=mine),
        )
        .annotate(is_done=models.ExpressionWrapper(is_done, output_field=models.BooleanField()))
        .order_by("enrolled_at", "pk")
    )
