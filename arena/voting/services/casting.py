"""Casting votes: stored once however often they arrive, and never changed.

In: an expert and a `Decision` about a matchup. Out: a `Vote` row, the same one for the same
decision sent again; or an error that says why nothing was stored.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import NamedTuple
from uuid import UUID

from django.conf import settings
from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import Q
from django.utils import timezone

from arena.errors import AlreadyDecided, InvalidVote, TooFast
from arena.models import AIDS, Matchup, Question, Study, Vote
from arena.voting.queries.ballots import VotingProgress, hold_matchup, require_open, voting_state
from arena.voting.queries.showings import note_objects
from arena.voting.services.turns import in_turn
from augment.errors import Conflict
from augment.services import make_storable
from augment.services.judging import FaultClass

LONGEST_COMMENT = 1000
PACE_WINDOW = timedelta(seconds=5)
PREFERENCES = (Vote.Outcome.LEFT, Vote.Outcome.RIGHT)
MOST_FAULTS = 20
FAULT_CLASSES = tuple(fault.value for fault in FaultClass)


class FaultMark(NamedTuple):
    """Mark of an expert on an object: wrong in one class.

    Attributes:
        side: left or right.
        place: Of the object among those that its pair lists for the side, from 0.
        fault: One of FAULT_CLASSES.
    """

    side: str
    place: int
    fault: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A decision of an expert on a matchup; its parts are known and go together.

    Attributes:
        key: Made by the browser, one per decision.
        matchup: One of the expert's own.
        outcome: One of Vote.Outcome; the side is kept apart from who won.
        question: Which of the study's is answered; empty is the primary one.
        both_miss: With "equal": both miss the instruction. Counts as a tie.
        strength: With "left" or "right": "slightly" or "clearly", empty where it was not said.
        reason: With "skip": why, one of Vote.SkipReason.
        comment: Whatever the expert wants to add.
        aids: What was used to look, out of AIDS.
        faults: What is wrong in the pictures, where the study asks for it; nothing is needed.
        supersedes: The key of the matchup's current vote on the question, to change it.
        ms_visible: How long the pair was on screen.

    Raises:
        InvalidVote: Parts do not go together, or are unknown.
    """

    key: UUID
    matchup: UUID
    outcome: str
    question: str = ""
    both_miss: bool = False
    strength: str = ""
    reason: str = ""
    comment: str = ""
    aids: Collection[str] = ()
    faults: Collection[FaultMark] = ()
    supersedes: UUID | None = None
    ms_visible: int | None = None

    def __post_init__(self) -> None:
        """Refuse parts that are unknown or contradict the outcome."""
        outcome, faults = self.outcome, dict[str, str]()
        if outcome not in Vote.Outcome:
            faults["outcome"] = f"One of these is needed: {', '.join(Vote.Outcome.values)}."
        if self.both_miss and outcome != Vote.Outcome.EQUAL:
            faults["both_miss"] = "Both can only miss the instruction where they are equal."
        is_strength = self.strength in Vote.Strength and outcome in PREFERENCES
        if self.strength and not is_strength:
            allowed = " or ".join(Vote.Strength.values)
            faults["strength"] = f"Only a preference has a strength: {allowed}."
        if outcome == Vote.Outcome.SKIP and self.reason not in Vote.SkipReason.values:
            faults["reason"] = f"A skip needs one of: {', '.join(Vote.SkipReason.values)}."
        if outcome != Vote.Outcome.SKIP and self.reason:
            faults["reason"] = "Only a skip has a reason."
        if len(self.comment) > LONGEST_COMMENT:
            faults["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
        if unknown := sorted(set(self.aids) - set(AIDS)):
            faults["aids"] = f"Unknown: {', '.join(unknown)}. Known: {', '.join(AIDS)}."
        if fault := _find_fault_of_marks(self):
            faults["faults"] = fault
        if faults:
            raise InvalidVote(faults)


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteResult:
    """Result of a vote.

    Attributes:
        study: As it is now; columns that a vote does not need are loaded when asked for.
        progress: The expert's, after the vote.
    """

    vote: Vote
    study: Study
    progress: VotingProgress


def cast_vote(*, expert: User, decision: Decision) -> Vote:
    """Store what an expert decided; the same key and content again is the same vote.

    For callers of our own, without a limit on the pace; browsers come in by `receive_vote`.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        StudyNotOpen: The study takes no votes.
        AlreadyDecided: The question has a vote that `supersedes` does not name.
        Conflict: The key belongs to another vote, or `supersedes` names none on this question.
        InvalidVote: The study does not allow it, or asks another question first.
    """
    return receive_vote(expert=expert, decision=decision, is_paced=False).vote


def receive_vote(*, expert: User, decision: Decision, is_paced: bool = True) -> VoteResult:
    """Store what an expert's browser sent, at a pace that a person can keep.

    The limit (ARENA_VOTES_PER_S over five seconds) counts stored votes, so it holds for any
    number of web processes.

    Raises:
        TooFast: The account votes faster than that; nothing was stored.
        DatabaseBusy: It could not be written within VOTE_WAIT_S; nothing was stored.
        AugmentError: As in `cast_vote`.
    """
    with in_turn(within_s=settings.VOTE_WAIT_S if is_paced else None):
        try:
            return _write(expert, decision, is_paced)
        except IntegrityError:
            # Another request stored the same key or decided the same matchup in between. That
            # one counts; looked at again, this one is its replay or too late.
            return _write(expert, decision, is_paced)


# --- Private -----------------------------------------------------------------------------------


def _find_fault_of_marks(decision: Decision) -> str:
    marks = decision.faults
    if marks and decision.outcome == Vote.Outcome.SKIP:
        return "A skip marks nothing."
    if len(set(marks)) < len(marks) or len(marks) > MOST_FAULTS:
        return f"At most {MOST_FAULTS} marks, and each only once."
    if any(mark.side not in PREFERENCES or mark.fault not in FAULT_CLASSES for mark in marks):
        return f"Each mark is of left or right, and one of: {', '.join(FAULT_CLASSES)}."
    return ""


@transaction.atomic
def _write(expert: User, decision: Decision, is_paced: bool) -> VoteResult:
    matchup = hold_matchup(expert=expert, code=decision.matchup)
    questions = matchup.study.questions
    decision = replace(decision, question=decision.question or questions[0])
    stored = list(Vote.objects.filter(Q(key=decision.key) | Q(matchup_id=matchup.pk)).order_by())
    vote = next((vote for vote in stored if vote.key == decision.key), None)
    is_new = vote is None
    if vote is not None:
        _check_replay(vote, matchup, decision)
    else:
        require_open(matchup.study)
        _check_turn(decision, questions, {vote.question for vote in stored})
        own = [vote for vote in stored if vote.question == decision.question]
        vote = _insert(matchup, expert, decision, _find_superseded(own, decision.supersedes))
    # Read after the lock, so that a study closed while we waited is seen as closed.
    since = timezone.now() - PACE_WINDOW
    study, progress, just_now = voting_state(study=matchup.study, expert=expert, since=since)
    if is_new:
        _check_allowed(decision, study)
        if is_paced and just_now > settings.VOTES_PER_S * PACE_WINDOW.total_seconds():
            raise TooFast(math.ceil(PACE_WINDOW.total_seconds() / 2))
    return VoteResult(vote=vote, study=study, progress=progress)


_SAME_COLUMNS = ("key", "question", "outcome", "both_miss", "strength", "reason", "ms_visible")
"""Of a vote, what a decision holds by the same name and as it is stored."""


def _insert(matchup: Matchup, expert: User, decision: Decision, old: Vote | None) -> Vote:
    winners = {Vote.Outcome.LEFT: matchup.left_id, Vote.Outcome.RIGHT: matchup.right_id}
    vote = Vote(
        **{name: getattr(decision, name) for name in _SAME_COLUMNS},
        matchup_id=matchup.pk,
        expert=expert,
        shown_left_id=matchup.left_id,
        shown_right_id=matchup.right_id,
        winner_id=winners.get(Vote.Outcome(decision.outcome)),
        comment=make_storable(decision.comment.strip()),
        faults=_name_objects(matchup, decision.faults),
        aids=" ".join(aid for aid in AIDS if aid in decision.aids),
        supersedes=old,
        is_simulated=expert.person.is_simulated,
    )
    vote.save(force_insert=True)
    return vote


def _name_objects(matchup: Matchup, marks: Collection[FaultMark]) -> list[list[str]]:
    """Return marks as they are stored, with the ids of their objects."""
    if not marks:
        return []
    note_objects([matchup])
    left, right = matchup.objects_shown or ([], [])
    try:
        return [
            [
                mark.side,
                (left if mark.side == Vote.Outcome.LEFT else right)[mark.place][0],
                mark.fault,
            ]
            for mark in sorted(marks)
        ]
    except IndexError:
        counts = f"{len(left)} on the left, {len(right)} on the right"
        raise InvalidVote({"faults": f"Only listed objects can be marked: {counts}."}) from None


def _find_superseded(stored: list[Vote], supersedes: UUID | None) -> Vote | None:
    """The vote that the new one replaces, None for a first vote."""
    if not stored:
        if supersedes is not None:
            raise Conflict("There is no vote yet that this one could supersede.")
        return None
    superseded = {vote.supersedes_id for vote in stored}
    current = next(vote for vote in stored if vote.pk not in superseded)
    if supersedes != current.key:
        raise AlreadyDecided(current.outcome)
    return current


def _check_replay(vote: Vote, matchup: Matchup, decision: Decision) -> None:
    if vote.matchup_id != matchup.pk:
        raise Conflict("This key belongs to another vote; make a new key for every decision.")
    old = None if vote.supersedes is None else vote.supersedes.key
    parts = ("question", "outcome", "both_miss", "strength", "reason")
    is_same = all(getattr(vote, part) == getattr(decision, part) for part in parts)
    is_same = is_same and vote.faults == _name_objects(matchup, decision.faults)
    if not is_same or old != decision.supersedes:
        raise AlreadyDecided(vote.outcome)


def _check_turn(decision: Decision, questions: Sequence[str], answered: Collection[str]) -> None:
    """Raise InvalidVote for a question that the study does not ask, or not yet."""
    question = decision.question
    if question not in questions:
        raise InvalidVote({"question": f"This study asks: {', '.join(questions)}."})
    if decision.outcome == Vote.Outcome.SKIP and question != questions[0]:
        raise InvalidVote({"question": f"A skip is of the whole pair: of {questions[0]}."})
    for earlier in questions[: questions.index(question)]:
        if earlier not in answered:
            raise InvalidVote({"question": f"The study asks first: {earlier}."})


def _check_allowed(decision: Decision, study: Study) -> None:
    """Raise where the study does not take the vote that was just written, which takes it back."""
    require_open(study)
    is_of_instruction = decision.question == Question.INSTRUCTION
    if decision.both_miss and not (study.allow_both_miss and is_of_instruction):
        raise InvalidVote({"both_miss": "Nobody is asked here whether both miss."})
    if decision.strength and not study.ask_strength:
        raise InvalidVote({"strength": "This study does not ask how clear a preference is."})
    if decision.faults and not study.ask_why:
        raise InvalidVote({"faults": "This study does not ask what is wrong."})
    if "replay" in decision.aids and not study.allow_replay:
        raise InvalidVote({"aids": "This study has no drives to play."})
