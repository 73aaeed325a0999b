"""Who has enrolled in a study, and how far they are."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from django.contrib.auth.models import User
from django.db.models import Count, F, Max, Q, QuerySet

from arena.errors import NotYours
from arena.models import EnrolledVoter, Enrolment, Study

Voters = QuerySet[Any]
"""Of EnrolledVoter, with what is counted about each."""


def enrolment_by_token(token: str) -> Enrolment:
    """The enrolment of a link.

    Raises:
        NotYours: No link has this token.
    """
    found = Enrolment.objects.select_related("study").filter(token=token).first()
    if found is None:
        raise NotYours("No study enrols by this link.")
    return found


def enrolled_voters(enrolment: Enrolment) -> Voters:
    """Everybody who ever took a place; one query.

    Each has `planned`, `answered` and `skipped` (pairs; a skip is an answer as well) and
    `last_vote_at`.
    """
    mine = Q(expert__matchups__study=enrolment.study_id)
    answered = mine & Q(expert__matchups__votes__isnull=False)
    skipped = mine & Q(
        expert__matchups__votes__outcome="skip", expert__matchups__votes__superseded_by=None
    )
    return (
        EnrolledVoter.objects.filter(enrolment=enrolment)
        .select_related("expert__person")
        .annotate(
            planned=Count("expert__matchups", filter=mine, distinct=True),
            answered=Count("expert__matchups", filter=answered, distinct=True),
            skipped=Count("expert__matchups", filter=skipped, distinct=True),
            last_vote_at=Max("expert__matchups__votes__at", filter=mine),
        )
        .order_by("enrolled_at", "pk")
    )


def taking_a_place(voters: Voters) -> Voters:
    """Those who are done or may still become so."""
    return voters.filter(dropped_at=None)


def find_unfinished(enrolment: Enrolment) -> Voters:
    """Who has a place and pairs without an answer."""
    return taking_a_place(enrolled_voters(enrolment)).filter(answered__lt=F("planned"))


def find_silent(enrolment: Enrolment, *, now: datetime) -> Voters:
    """Who has a place, is not done and was not heard for as long as the enrolment allows."""
    found = find_unfinished(enrolment)
    if enrolment.drop_out_after_h is None:
        return found.none()
    since = now - timedelta(hours=enrolment.drop_out_after_h)
    is_quiet = Q(last_vote_at=None) | Q(last_vote_at__lte=since)
    return found.filter(is_quiet, enrolled_at__lte=since)


def has_free_place(enrolment: Enrolment) -> bool:
    """Whether somebody may still take a place; what the others have judged is not looked at."""
    return enrolment.voters.filter(dropped_at=None).count() < enrolment.places


@dataclass(frozen=True, slots=True, kw_only=True)
class EnrolmentState:
    """How many places there are, and what became of them."""

    places: int
    taken: int
    done: int
    dropped: int

    @property
    def free(self) -> int:
        """Places that somebody may still take."""
        return max(self.places - self.taken, 0)


def state_of(enrolment: Enrolment) -> EnrolmentState:
    """Counted anew; two queries."""
    voters = enrolled_voters(enrolment)
    kept = taking_a_place(voters)
    done = kept.filter(planned__gt=0, answered__gte=F("planned"))
    return EnrolmentState(
        places=enrolment.places,
        taken=kept.count(),
        done=done.count(),
        dropped=enrolment.voters.exclude(dropped_at=None).count(),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnEnrolment:
    """What somebody who enrolled is told at the end.

    Attributes:
        completion_code: Empty unless every pair has an answer.
        was_given_on: Whether the place went to somebody else after a long silence.
    """

    completion_code: str
    was_given_on: bool


def code_told(voter: Any) -> str:
    """The completion code of one of `enrolled_voters`, empty unless every pair has an answer."""
    is_done = voter.dropped_at is None and 0 < voter.planned <= voter.answered
    return voter.completion_code if is_done else ""


def own_enrolment(study: Study, expert: User) -> OwnEnrolment | None:
    """None for who did not come by an enrolment link of this study."""
    enrolment = Enrolment.objects.filter(study=study).first()
    if enrolment is None:
        return None
    voter = enrolled_voters(enrolment).filter(expert=expert).first()
    if voter is None:
        return None
    return OwnEnrolment(
        completion_code=code_told(voter), was_given_on=voter.dropped_at is not None
    )
