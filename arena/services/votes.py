"""Casting votes: stored once however often they arrive, and never changed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from uuid import UUID

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import Q
from django.utils import timezone

from arena.errors import AlreadyDecided, NotYours, StudyNotOpen
from arena.models import Matchup, Study, Vote
from augment.errors import Conflict


def cast_vote(
    *,
    expert: User,
    matchup_code: UUID | str,
    key: UUID | str,
    outcome: str,
    supersedes: UUID | str | None = None,
    ms_visible: int | None = None,
) -> Vote:
    """Store what an expert decided; the same key and content again is the same vote.

    Args:
        expert: Whose vote it is.
        matchup_code: What was decided; one of the expert's own matchups.
        key: Made by the browser, one per decision.
        outcome: "left", "equal" or "right"; the side is kept apart from who won.
        supersedes: The key of the matchup's current vote, to change it.
        ms_visible: How long the pair was on screen.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        StudyNotOpen: The study takes no votes.
        AlreadyDecided: The matchup has a vote that `supersedes` does not name.
        Conflict: The key belongs to another vote, or `supersedes` names none of this matchup's.
        ValueError: The outcome is none of the three.
    """
    cast = partial(
        _cast,
        expert=expert,
        matchup_code=_uuid(matchup_code),
        key=_uuid(key),
        outcome=Vote.Outcome(outcome),
        supersedes=None if supersedes is None else _uuid(supersedes),
        ms_visible=ms_visible,
    )
    try:
        return cast()
    except IntegrityError:
        # Another request stored the same key or decided the same matchup in between. That one
        # counts; looked at again, this one is its replay or too late. Anything else is a fault.
        return cast()


def mark_served(*, matchups: Sequence[Matchup]) -> None:
    """Remember when matchups went out to their expert for the first time."""
    fresh = [matchup.pk for matchup in matchups if matchup.served_at is None]
    if fresh:
        Matchup.objects.filter(pk__in=fresh, served_at=None).update(served_at=timezone.now())


@transaction.atomic
def _cast(
    *,
    expert: User,
    matchup_code: UUID,
    key: UUID,
    outcome: Vote.Outcome,
    supersedes: UUID | None,
    ms_visible: int | None,
) -> Vote:
    matchup = _lock(expert, matchup_code)
    known = list(
        Vote.objects.filter(Q(key=key) | Q(matchup=matchup))
        .select_related("supersedes", "superseded_by")
        .order_by("pk")
    )
    for vote in known:
        if vote.key == key:
            return _replayed(vote, matchup, outcome, supersedes)
    _check_open(matchup)
    old = _superseded(known, supersedes)
    winner = {
        Vote.Outcome.LEFT: matchup.left_id,
        Vote.Outcome.EQUAL: None,
        Vote.Outcome.RIGHT: matchup.right_id,
    }[outcome]
    return Vote.objects.create(
        key=key,
        matchup=matchup,
        expert=expert,
        shown_left_id=matchup.left_id,
        shown_right_id=matchup.right_id,
        outcome=outcome,
        winner_id=winner,
        supersedes=old,
        is_simulated=_is_simulated(matchup.expert),
        ms_visible=ms_visible,
    )


def _lock(expert: User, code: UUID) -> Matchup:
    """The expert's matchup, its row held until the vote is stored.

    The lock makes two votes on one matchup wait for each other, and the closing of the study for
    both. SQLite needs none: its transactions write one after the other.
    """
    found = (
        Matchup.objects.select_for_update(of=("self",))
        .select_related("expert__person")
        .filter(code=code, expert=expert)
        .first()
    )
    if found is None:
        raise NotYours("This matchup is not yours.")
    return found


def _check_open(matchup: Matchup) -> None:
    """Read after the lock, so that a study closed while we waited is seen as closed."""
    study = Study.objects.only("name", "state").get(pk=matchup.study_id)
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study {study.name!r} takes no votes: it is {study.state}.")


def _replayed(
    vote: Vote, matchup: Matchup, outcome: Vote.Outcome, supersedes: UUID | None
) -> Vote:
    if vote.matchup_id != matchup.pk:
        raise Conflict("This key belongs to another vote; make a new key for every decision.")
    old = None if vote.supersedes is None else vote.supersedes.key
    if vote.outcome != outcome or old != supersedes:
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


def _is_simulated(expert: User) -> bool:
    return hasattr(expert, "person") and expert.person.is_simulated


def _uuid(value: UUID | str) -> UUID:
    return value if isinstance(value, UUID) else UUID(value)
