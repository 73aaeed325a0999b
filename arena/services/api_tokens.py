"""Tokens of programs: made, used and revoked; none kept readable."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import timedelta

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Case, F, Q, Value, When
from django.utils import timezone
from django.utils.translation import gettext as _

from arena.errors import TokenOver, TooManyRequests
from arena.models import ApiToken, token_digest
from arena.queries.api_tokens import api_token_by_secret, effective_role, roles_offered
from arena.queries.people import role_of
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
    """Make a token for a program that acts for this account.

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
        allowed = ", ".join(map(str, DAYS))
        raise Conflict(
            _("A token works for %(allowed)s days, not %(n)s.") % {"allowed": allowed, "n": days}
        )
    now = timezone.now()
    if (
        ApiToken.objects.filter(owner=owner, revoked_at=None, expires_at__gt=now).count()
        >= MOST_ALIVE
    ):
        raise Conflict(
            _("You have %(n)s tokens already; revoke one of them first.") % {"n": MOST_ALIVE}
        )
    secret = PREFIX + secrets.token_urlsafe(32)
    token = ApiToken.objects.create(
        owner=owner,
        name=name,
        role=role,
        token_sha256=token_digest(secret),
        expires_at=now + timedelta(days=days),
    )
    _log(token, owner, "add")
    return FreshToken(token=token, secret=secret)


@transaction.atomic
def revoke_api_token(*, token: ApiToken, actor: User) -> None:
    """Let a token open nothing any more; twice changes nothing."""
    alive = ApiToken.objects.filter(pk=token.pk, revoked_at=None)
    if alive.update(revoked_at=timezone.now()):
        _log(token, actor, "revoke")


def use_api_token(secret: str) -> tuple[User, ApiToken]:
    """Whose token it is, with the role that it opens as `token_role`; the request is counted.

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


# --- Private -----------------------------------------------------------------------------------


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


def _log(token: ApiToken, actor: User, verb: str) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="api token",
        object_code=token.code,
        after={
            "name": token.name,
            "role": token.role,
            "owner": str(token.owner.person.code),
            "expires_at": token.expires_at.isoformat(),
        },
    )
