"""Inviting experts by link: made, accepted and taken back, each logged and none kept readable."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import timedelta

from django.contrib.auth.models import User
from django.contrib.sessions.models import Session
from django.db import transaction
from django.utils import timezone

from arena.errors import LinkOver
from arena.models import Invitation, Study, token_digest
from arena.queries.studies.invitations import invitation_by_token, may_be_let_in
from arena.services.people import must_take_part
from augment.errors import Conflict
from augment.services.events import log_event

LINK_LIVES = timedelta(days=14)

SESSION_KEY = "invitation"
"""Where a session keeps the code of the link that began it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FreshLink:
    """A link just made; the token is nowhere else and can't be read again."""

    invitation: Invitation
    token: str


@transaction.atomic
def invite(*, study: Study, expert: User, actor: User | None = None) -> FreshLink:
    """Make a link that lets this expert into the study for 14 days; it replaces the one before.

    Who is signed in by the older link stays so; only `revoke` ends that.

    Raises:
        NotYours: The account does not take part in the study.
        Conflict: The study was cancelled, or the account can't be let in by a link: it is
            simulated, inactive, or more than an expert.
    """
    must_take_part(study=study, expert=expert)
    if study.state == Study.State.CANCELLED:
        raise Conflict(f"The study '{study.name}' was cancelled; nobody is invited.")
    if not may_be_let_in(expert):
        raise Conflict(
            f"{expert.get_username()} can't be invited by a link: links are for active "
            "experts who are neither simulated nor analysts or admins."
        )
    # Held, so that of two links made at once the second one sees the first, which it replaces.
    Study.objects.select_for_update(no_key=True).get(pk=study.pk)
    now = timezone.now()
    older = Invitation.objects.select_for_update().filter(
        study=study, expert=expert, revoked_at=None
    )
    replaced = [str(code) for code in older.values_list("code", flat=True)]
    older.update(revoked_at=now)
    token = secrets.token_urlsafe(32)
    invitation = Invitation.objects.create(
        study=study,
        expert=expert,
        token_sha256=token_digest(token),
        invited_by=actor,
        expires_at=now + LINK_LIVES,
    )
    log_event(
        actor=actor,
        verb="invite",
        object_kind="invitation",
        object_code=invitation.code,
        before={"replaced": replaced} if replaced else None,
        after=_logged(invitation),
    )
    return FreshLink(invitation=invitation, token=token)


@transaction.atomic
def accept(*, token: str) -> Invitation:
    """Let the expert of a link in; it goes on working on their other devices until it ends.

    Raises:
        NotYours: No link has this token.
        LinkOver: It expired, was taken back, or its account may not be let in any more.
    """
    invitation = invitation_by_token(token, locked=True)
    now = timezone.now()
    if invitation.state(now) not in Invitation.ALIVE or not may_be_let_in(invitation.expert):
        raise LinkOver("This link lets nobody in any more.")
    is_first = invitation.used_at is None
    if is_first:
        invitation.used_at = now
        invitation.save(update_fields=["used_at"])
    log_event(
        actor=invitation.expert,
        verb="accept",
        object_kind="invitation",
        object_code=invitation.code,
        after={"is_first": is_first},
    )
    return invitation


@transaction.atomic
def revoke(*, invitation: Invitation, actor: User | None = None) -> int:
    """Take a link back and sign out whoever came in by a link to the same study.

    Returns:
        How many sessions ended; taking back twice changes nothing more.
    """
    row = Invitation.objects.select_for_update().get(pk=invitation.pk)
    if row.revoked_at is None:
        row.revoked_at = timezone.now()
        row.save(update_fields=["revoked_at"])
    ended = _end_sessions(row)
    log_event(
        actor=actor,
        verb="revoke",
        object_kind="invitation",
        object_code=row.code,
        after={**_logged(row), "sessions_ended": ended},
    )
    return ended


def _end_sessions(invitation: Invitation) -> int:
    """Delete the sessions that a link of this expert and study began."""
    same = Invitation.objects.filter(study=invitation.study_id, expert=invitation.expert_id)
    codes = {str(code) for code in same.values_list("code", flat=True)}
    begun = [
        session.pk
        for session in Session.objects.filter(expire_date__gt=timezone.now())
        if session.get_decoded().get(SESSION_KEY) in codes
    ]
    Session.objects.filter(pk__in=begun).delete()
    return len(begun)


def _logged(invitation: Invitation) -> dict[str, str]:
    return {
        "study": str(invitation.study.code),
        "expert": str(invitation.expert.person.code),
        "expires_at": invitation.expires_at.isoformat(),
    }
