"""Links and tokens: a program's token, an expert's invitation; none is stored readable.

Marks of authorship stand here too: like a link, each joins one expert to one study.
"""

import secrets
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from django.contrib.auth.models import User
from django.contrib.sessions.models import Session
from django.db import transaction
from django.db.models import Case, F, Q, Value, When
from django.utils import timezone
from django.utils.translation import gettext as _

from arena.errors import LinkOver, NotYours, TokenOver, TooManyRequests
from arena.models import ApiToken, Authorship, Invitation, Study, token_digest
from arena.people.queries import (
    api_token_by_secret,
    effective_role,
    invitation_by_token,
    may_be_let_in,
    role_of,
    roles_offered,
)
from augment.errors import Conflict, UnknownName
from augment.services.events import log_event
from augment.services.texts import one_line

PREFIX = "arena_"
"""What every token begins with, so that whoever finds one knows what it is."""

DAYS = (1, 7, 30, 90, 365)
"""How long a token may work."""

MOST_ALIVE = 50
"""So many tokens one account may have at once."""

WINDOW = timedelta(minutes=1)
REQUESTS = {"admin": 1200, "analyst": 1200, "expert": 600}
"""So many requests a window, by the role of the token; counted in the database, so that it holds
for all web servers together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FreshToken:
    """A token just made; the secret is nowhere else and can't be read again."""

    token: ApiToken
    secret: str


@transaction.atomic
def make_api_token(*, owner: User, name: str, role: str, days: int) -> FreshToken:
    """Create a token for a program that acts for this account.

    Args:
        owner: Whose it is; only they make it.
        name: What it is for.
        role: One of `roles_offered`.
        days: How long it works, one of `DAYS`.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        UnknownName: The role is none that the owner may give.
        Conflict: It is to work for another time, or the owner has too many.
    """
    name = one_line("name", name, what="token", longest=80)
    offered = roles_offered(owner)
    if role not in offered:
        raise UnknownName("role", role, list(offered))
    if days not in DAYS:
        problem = _("A token works for %(allowed)s days, not %(n)s.")
        raise Conflict(problem % {"allowed": ", ".join(map(str, DAYS)), "n": days})
    now = timezone.now()
    alive = ApiToken.objects.filter(owner=owner, revoked_at=None, expires_at__gt=now)
    if alive.count() >= MOST_ALIVE:
        problem = _("You have %(n)s tokens already; revoke one of them first.")
        raise Conflict(problem % {"n": MOST_ALIVE})
    secret = PREFIX + secrets.token_urlsafe(32)
    token = ApiToken.objects.create(
        owner=owner,
        name=name,
        role=role,
        token_sha256=token_digest(secret),
        expires_at=now + timedelta(days=days),
    )
    _log_token(token, owner, "add")
    return FreshToken(token=token, secret=secret)


@transaction.atomic
def revoke_api_token(*, token: ApiToken, actor: User) -> None:
    """Revoke a token; twice changes nothing."""
    alive = ApiToken.objects.filter(pk=token.pk, revoked_at=None)
    if alive.update(revoked_at=timezone.now()):
        _log_token(token, actor, "revoke")


def use_api_token(secret: str) -> tuple[User, ApiToken]:
    """Return the owner of a token, with its role as `token_role`; the request is counted.

    Raises:
        TokenOver: It is nobody's, over, or its owner may do nothing of the kind any more.
        TooManyRequests: More requests than its role has within the window.
    """
    token = api_token_by_secret(secret)
    role = None if token is None else effective_role(token.role, role_of(token.owner))
    if token is None or role is None:
        raise TokenOver("This token opens nothing: it is unknown, expired or revoked.")
    _count(token, REQUESTS[role])
    owner = token.owner
    owner.token_role = role  # type: ignore[attr-defined]
    return owner, token


def _count(token: ApiToken, most: int) -> None:
    """Count one request of the window, which begins with the first request after the last one.

    In one statement: of two that come at once in a new window, each finds the other counted.
    """
    now = timezone.now()
    is_new = Q(window_began_at=None) | Q(window_began_at__lte=now - WINDOW)
    free = ApiToken.objects.filter(is_new | Q(window_requests__lt=most), pk=token.pk)
    if not free.update(
        window_requests=Case(When(is_new, then=Value(1)), default=F("window_requests") + 1),
        window_began_at=Case(When(is_new, then=Value(now)), default=F("window_began_at")),
        last_used_at=now,
    ):
        raise TooManyRequests(most, WINDOW.seconds)


def _log_token(token: ApiToken, actor: User, verb: str) -> None:
    after = {
        "name": token.name,
        "role": token.role,
        "owner": str(token.owner.person.code),
        "expires_at": token.expires_at.isoformat(),
    }
    log_event(actor=actor, verb=verb, object_kind="api token", object_code=token.code, after=after)


# --- Invitations -------------------------------------------------------------------------------

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
    before = {"replaced": replaced} if replaced else None
    _log_invitation(invitation, "invite", actor, _facts(invitation), before)
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
    _log_invitation(invitation, "accept", invitation.expert, {"is_first": is_first})
    return invitation


@transaction.atomic
def revoke(*, invitation: Invitation, actor: User | None = None) -> int:
    """Revoke a link and sign out whoever came in by a link to the same study.

    Returns:
        How many sessions ended; revoking twice changes nothing more.
    """
    row = Invitation.objects.select_for_update().get(pk=invitation.pk)
    if row.revoked_at is None:
        row.revoked_at = timezone.now()
        row.save(update_fields=["revoked_at"])
    ended = _end_sessions(row)
    _log_invitation(row, "revoke", actor, {**_facts(row), "sessions_ended": ended})
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


def _facts(invitation: Invitation) -> dict[str, Any]:
    return {
        "study": str(invitation.study.code),
        "expert": str(invitation.expert.person.code),
        "expires_at": invitation.expires_at.isoformat(),
    }


def _log_invitation(
    row: Invitation,
    verb: str,
    actor: User | None,
    after: dict[str, Any],
    before: dict[str, Any] | None = None,
) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="invitation",
        object_code=row.code,
        before=before,
        after=after,
    )


# --- Authorships -------------------------------------------------------------------------------


def must_take_part(*, study: Study, expert: User) -> None:
    """Raise NotYours for an account that is no expert of the study."""
    if not study.experts.filter(pk=expert.pk).exists():
        raise NotYours(f"{expert.get_username()} does not take part in '{study.name}'.")


@transaction.atomic
def mark_author(
    *, study: Study, expert: User, contestant: str, actor: User | None = None
) -> Authorship:
    """Mark an expert as an author of a contestant of the study, whatever its state.

    Their votes stay as they are; ratings made from then on know of it. Twice changes nothing.

    Args:
        study: Also an open one: experts see nothing of it.
        expert: Takes part in the study.
        contestant: The slug of one of its contestants.
        actor: Who says so, for the log.

    Raises:
        NotYours: The account does not take part in the study.
        UnknownName: The study has no such contestant.
    """
    must_take_part(study=study, expert=expert)
    made = study.contestants.filter(slug=contestant).first()
    if made is None:
        known = study.contestants.order_by("slug").values_list("slug", flat=True)
        raise UnknownName("contestant", contestant, list(known))
    row, is_new = Authorship.objects.get_or_create(
        study=study, expert=expert, contestant=made, defaults={"marked_by": actor}
    )
    if is_new:
        _log_author("mark author", row, actor)
    return row


@transaction.atomic
def take_back_author(*, authorship: Authorship, actor: User | None = None) -> None:
    """Remove a mark of authorship; ratings made before keep it.

    Twice changes nothing more.
    """
    held = Authorship.objects.select_for_update(of=("self",)).filter(pk=authorship.pk).first()
    if held is None:
        return
    _log_author("take back author", held, actor)
    held.delete()


def _log_author(verb: str, row: Authorship, actor: User | None) -> None:
    after = {"expert": str(row.expert.person.code), "contestant": row.contestant.slug}
    log_event(actor=actor, verb=verb, object_kind="study", object_code=row.study.code, after=after)
