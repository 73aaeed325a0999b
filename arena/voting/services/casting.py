"""What an expert may decide about a pair, read from what came in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import timedelta
from functools import cache
from uuid import UUID

from django.conf import settings
from django.contrib.auth.models import User
from django.db import IntegrityError, connection, transaction
from django.db.models import Q
from django.utils import timezone

from arena.errors import AlreadyDecided, InvalidVote, NotYours, StudyNotOpen, TooFast
from arena.models import AIDS, Matchup, Study, Vote
from arena.voting.queries.ballots import (
    HeldMatchup,
    VotingState,
    held_matchup,
    upcoming,
    voting_state,
)
from arena.voting.services.turns import in_turn
from augment.errors import Conflict
from augment.models import Event
from augment.services.events import log_event
from augment.services.texts import make_storable

LONGEST_COMMENT = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What an expert decided, as it came in; its parts go together."""

    key: UUID
    matchup: UUID
    outcome: Vote.Outcome
    both_miss: bool
    reason: str
    comment: str
    aids: str
    supersedes: UUID | None
    ms_visible: int | None


def decision_of(
    *,
    matchup_code: UUID | str,
    key: UUID | str,
    outcome: str,
    both_miss: bool = False,
    reason: str = "",
    comment: str = "",
    aids: Iterable[str] = (),
    supersedes: UUID | str | None = None,
    ms_visible: int | None = None,
) -> Decision:
    """Read what came in.

    Args:
        matchup_code: What was decided; one of the expert's own matchups.
        key: Made by the browser, one per decision.
        outcome: "left", "equal", "right" or "skip"; the side is kept apart from who won.
        both_miss: With "equal": both miss the instruction. Counts as a tie.
        reason: With "skip": why, one of Vote.SkipReason.
        comment: Whatever the expert wants to add.
        aids: What was used to look, out of AIDS.
        supersedes: The key of the matchup's current vote, to change it.
        ms_visible: How long the pair was on screen.

    Raises:
        ValueError: The outcome is none of the four.
        InvalidVote: Parts do not go together, or are unknown.
    """
    chosen = Vote.Outcome(outcome)
    _check_parts(chosen, both_miss, reason, comment, used := set(aids))
    return Decision(
        key=_uuid(key),
        matchup=_uuid(matchup_code),
        outcome=chosen,
        both_miss=both_miss,
        reason=reason,
        comment=make_storable(comment.strip()),
        aids=" ".join(aid for aid in AIDS if aid in used),
        supersedes=None if supersedes is None else _uuid(supersedes),
        ms_visible=ms_visible,
    )


def _check_parts(
    outcome: Vote.Outcome, both_miss: bool, reason: str, comment: str, aids: set[str]
) -> None:
    wrong = {}
    if both_miss and outcome != Vote.Outcome.EQUAL:
        wrong["both_miss"] = "Both can only miss the instruction where they are equal."
    if outcome == Vote.Outcome.SKIP and reason not in Vote.SkipReason.values:
        wrong["reason"] = f"A skip needs one of: {', '.join(Vote.SkipReason.values)}."
    if outcome != Vote.Outcome.SKIP and reason:
        wrong["reason"] = "Only a skip has a reason."
    if len(comment) > LONGEST_COMMENT:
        wrong["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
    if unknown := sorted(aids - set(AIDS)):
        wrong["aids"] = f"Unknown: {', '.join(unknown)}. Known: {', '.join(AIDS)}."
    if wrong:
        raise InvalidVote(wrong)


def _uuid(value: UUID | str) -> UUID:
    return value if isinstance(value, UUID) else UUID(value)


_COLUMNS = [field for field in Vote._meta.concrete_fields if not field.primary_key]


def insert(vote: Vote) -> Vote:
    """Store a vote that is not stored yet; gives it back with its number and time.

    Raises:
        IntegrityError: A constraint of the table does not hold.
    """
    values = [
        field.get_db_prep_save(field.pre_save(vote, add=True), connection) for field in _COLUMNS
    ]
    can_return = connection.features.can_return_columns_from_insert
    with connection.cursor() as cursor:
        cursor.execute(_insertion(can_return), values)
        if can_return:
            (vote.pk,) = cursor.fetchone()
        else:  # SQLite before 3.35
            vote.pk = connection.ops.last_insert_id(cursor, Vote._meta.db_table, "id")
    vote._state.adding = False
    vote._state.db = connection.alias
    return vote


def mark_served(*, matchups: Sequence[Matchup]) -> None:
    """Remember when matchups went out to their expert for the first time; within a transaction.

    Those that somebody holds are left out: they are being decided or handed over, and whoever
    holds one may wait for a row of ours.
    """
    fresh = [matchup.pk for matchup in matchups if matchup.served_at is None]
    if not fresh:
        return
    places = ", ".join(["%s"] * len(fresh))
    free = f"SELECT id FROM arena_matchup WHERE id IN ({places}) AND served_at IS NULL"
    if connection.features.has_select_for_update_skip_locked:
        free += f" {connection.ops.for_update_sql(skip_locked=True)}"
    now = connection.ops.adapt_datetimefield_value(timezone.now())
    with connection.cursor() as cursor:
        cursor.execute(
            f"UPDATE arena_matchup SET served_at = %s WHERE id IN ({free})", [now, *fresh]
        )


@cache
def _insertion(can_return: bool) -> str:
    names = ", ".join(connection.ops.quote_name(str(field.column)) for field in _COLUMNS)
    places = ", ".join(["%s"] * len(_COLUMNS))
    text = f"INSERT INTO {Vote._meta.db_table} ({names}) VALUES ({places})"
    return f"{text} RETURNING id" if can_return else text


PACE_WINDOW = timedelta(seconds=5)
FLAG_AGAIN_AFTER = timedelta(minutes=1)
"""An account that goes on voting too fast is written to the log this often, not for every try."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Received:
    """What came of a vote.

    Attributes:
        state: The study and the expert's progress after it.
        coming: What is planned for the expert next, marked as served; nothing where the study
            has closed.
    """

    vote: Vote
    state: VotingState
    coming: tuple[Matchup, ...]


def cast_vote(*, expert: User, decision: Decision) -> Vote:
    """Store what an expert decided; the same key and content again is the same vote.

    For callers of our own, without a limit on the pace; browsers come in by `receive_vote`.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        StudyNotOpen: The study takes no votes.
        AlreadyDecided: The matchup has a vote that `supersedes` does not name.
        Conflict: The key belongs to another vote, or `supersedes` names none of this matchup's.
        InvalidVote: The study does not allow it.
    """
    return _store(expert, decision, None).vote


def receive_vote(*, expert: User, decision: Decision, ahead: int = 0) -> Received:
    """Store what an expert's browser sent, at a pace that a person can keep.

    The limit (ARENA_VOTES_PER_S over five seconds) counts stored votes, so it holds for any
    number of web processes. An account that breaks it is flagged in the log.

    Args:
        expert: Whose vote it is.
        decision: What was decided.
        ahead: How many matchups to look ahead, at most.

    Raises:
        TooFast: The account votes faster than that; nothing was stored.
        DatabaseBusy: It could not be written within ARENA_VOTE_WAIT_S; nothing was stored.
        ArenaError: As in `cast_vote`.
        Conflict: As in `cast_vote`.
    """
    try:
        return _store(expert, decision, ahead)
    except TooFast:
        _flag(expert)
        raise


def _check_allowed(decision: Decision, state: VotingState, is_paced: bool) -> None:
    """Whether the study takes the vote that was just written; raising takes it back."""
    if state.study.state != Study.State.OPEN:
        raise _not_open(state.study)
    if decision.both_miss and not state.study.allow_both_miss:
        raise InvalidVote({"both_miss": "This study does not ask whether both miss."})
    if "text" in decision.aids.split() and not state.study.allow_text:
        raise InvalidVote({"aids": "This study has no text description."})
    if "replay" in decision.aids.split() and not state.study.allow_replay:
        raise InvalidVote({"aids": "This study has no drives to play."})
    if "measures" in decision.aids.split() and not state.study.allow_measures:
        raise InvalidVote({"aids": "This study has no measures."})
    if is_paced and state.just_now > settings.VOTES_PER_S * PACE_WINDOW.total_seconds():
        raise TooFast(math.ceil(PACE_WINDOW.total_seconds() / 2))


def _not_open(study: Study) -> StudyNotOpen:
    return StudyNotOpen(f"The study {study.name!r} takes no votes: it is {study.state}.")


def _flag(expert: User) -> None:
    flags = Event.objects.filter(actor=expert, verb="vote too fast")
    if not flags.filter(at__gt=timezone.now() - FLAG_AGAIN_AFTER).exists():
        log_event(
            actor=expert,
            verb="vote too fast",
            object_kind="person",
            object_code=expert.person.code,
            after={"votes_per_s": settings.VOTES_PER_S, "over_s": PACE_WINDOW.total_seconds()},
        )


# --- Storing -----------------------------------------------------------------------------------


def _store(expert: User, decision: Decision, ahead: int | None) -> Received:
    """Write at once, as most votes are first ones; look closer only where that fails.

    Without a number of matchups to look ahead the pace has no limit.
    """
    with in_turn(within_s=None if ahead is None else settings.VOTE_WAIT_S):
        return _store_in_turn(expert, decision, ahead)


def _store_in_turn(expert: User, decision: Decision, ahead: int | None) -> Received:
    if decision.supersedes is None:
        try:
            return _write(expert, decision, ahead)
        except IntegrityError:
            pass  # the matchup has a vote or the key is taken: a replay, or too late
    try:
        return _look_and_write(expert, decision, ahead)
    except IntegrityError:
        # Another request stored the same key or decided the same matchup in between. That one
        # counts; looked at again, this one is its replay or too late. Anything else is a fault.
        return _look_and_write(expert, decision, ahead)


@transaction.atomic
def _write(expert: User, decision: Decision, ahead: int | None) -> Received:
    matchup = _lock(expert, decision.matchup)
    vote = _insert(matchup, expert, decision, None)
    state = _state(matchup, expert)
    _check_allowed(decision, state, ahead is not None)
    return _received(vote, state, expert, ahead)


@transaction.atomic
def _look_and_write(expert: User, decision: Decision, ahead: int | None) -> Received:
    matchup = _lock(expert, decision.matchup)
    known = list(
        Vote.objects.filter(Q(key=decision.key) | Q(matchup_id=matchup.pk))
        .select_related("supersedes", "superseded_by")
        .order_by("pk")
    )
    for vote in known:
        if vote.key == decision.key:
            state = _state(matchup, expert)
            return _received(_replayed(vote, matchup, decision), state, expert, ahead)
    study = Study.objects.only("name", "state").get(pk=matchup.study_id)
    if study.state != Study.State.OPEN:
        raise _not_open(study)
    vote = _insert(matchup, expert, decision, _superseded(known, decision.supersedes))
    state = _state(matchup, expert)
    _check_allowed(decision, state, ahead is not None)
    return _received(vote, state, expert, ahead)


def _received(vote: Vote, state: VotingState, expert: User, ahead: int | None) -> Received:
    """In the vote's own transaction: SQLite lets one write at a time, so one has to do."""
    coming: list[Matchup] = []
    if ahead and state.study.state == Study.State.OPEN:
        coming = upcoming(study=state.study, expert=expert, n=ahead)
        mark_served(matchups=coming)
    return Received(vote=vote, state=state, coming=tuple(coming))


def _lock(expert: User, code: UUID) -> HeldMatchup:
    """The expert's matchup, its row held until the vote is stored.

    The lock makes two votes on one matchup wait for each other, and the closing of the study for
    both. Who has opened the study's results votes in it no longer.
    """
    matchup = held_matchup(code=code, expert_pk=expert.pk)
    if matchup is None:
        raise NotYours("This matchup is not yours.")
    return matchup


def _insert(matchup: HeldMatchup, expert: User, decision: Decision, old: Vote | None) -> Vote:
    winners = {Vote.Outcome.LEFT: matchup.left_id, Vote.Outcome.RIGHT: matchup.right_id}
    vote = Vote(
        key=decision.key,
        matchup_id=matchup.pk,
        expert=expert,
        shown_left_id=matchup.left_id,
        shown_right_id=matchup.right_id,
        outcome=decision.outcome,
        winner_id=winners.get(decision.outcome),
        both_miss=decision.both_miss,
        reason=decision.reason,
        comment=decision.comment,
        aids=decision.aids,
        supersedes=old,
        is_simulated=matchup.is_simulated,
        ms_visible=decision.ms_visible,
    )
    return insert(vote)


def _state(matchup: HeldMatchup, expert: User) -> VotingState:
    """Read after the lock, so that a study closed while we waited is seen as closed."""
    return voting_state(
        study_pk=matchup.study_id, expert=expert, since=timezone.now() - PACE_WINDOW
    )


def _replayed(vote: Vote, matchup: HeldMatchup, decision: Decision) -> Vote:
    if vote.matchup_id != matchup.pk:
        raise Conflict("This key belongs to another vote; make a new key for every decision.")
    old = None if vote.supersedes is None else vote.supersedes.key
    stored = (vote.outcome, vote.both_miss, vote.reason, old)
    if stored != (decision.outcome, decision.both_miss, decision.reason, decision.supersedes):
        raise AlreadyDecided(vote.outcome)
    return vote


def _superseded(known: list[Vote], supersedes: UUID | None) -> Vote | None:
    """The vote that the new one replaces, None for a first vote."""
    if not known:
        if supersedes is not None:
            raise Conflict("There is no vote yet that this one could supersede.")
        return None
    current = next(vote for vote in reversed(known) if not hasattr(vote, "superseded_by"))
    if supersedes != current.key:
        raise AlreadyDecided(current.outcome)
    return current
