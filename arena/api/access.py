"""Identity of a request, by a token or a session, the roles that may use a resource, and tokens.

Tokens are of programs: made, used, revoked; counted by the minute, and none stored readable.
"""

import secrets
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Case, F, Q, Value, When
from django.utils import timezone
from django.utils.translation import gettext as _
from rest_framework.authentication import BaseAuthentication
from rest_framework.permissions import SAFE_METHODS, BasePermission
from rest_framework.request import Request

from arena.errors import TokenOver, TooManyRequests
from arena.models import ApiToken, token_digest
from arena.shell.accounts import TOKEN_ROLES, effective_role, top_role
from augment.errors import Conflict, UnknownName
from augment.services import log_change, one_line

SCHEME = "bearer"
ADMINS = ("admin",)
STAFF = ("admin", "researcher")
EXPERTS = ("expert",)
ENTRANTS = ("entrant",)


class BearerToken(BaseAuthentication):
    """`Authorization: Bearer arena_...`; without that header the session decides."""

    def authenticate(self, request: Request) -> tuple[User, ApiToken] | None:
        """Return the owner, with the token's role, and the token.

        Raises:
            TokenOver: The token is unknown, expired or revoked.
            TooManyRequests: It was used too often.
        """
        scheme, _, secret = request.headers.get("Authorization", "").partition(" ")
        if scheme.lower() != SCHEME:
            return None
        if not secret.strip():
            raise TokenOver("No token follows the word Bearer.")
        return use_api_token(secret.strip())

    def authenticate_header(self, request: Request) -> str:
        """Return the `WWW-Authenticate` header of a 401."""
        return "Bearer"


class RoleAllowed(BasePermission):
    """Admit the roles in a view's `readers` and `writers`; both where a method does not exist."""

    def has_permission(self, request: Request, view: Any) -> bool:
        """Return whether the account has one of the roles."""
        allowed = view.readers if request.method in SAFE_METHODS else view.writers
        return top_role(request.user) in (allowed or (*view.readers, *view.writers))


# --- Tokens ------------------------------------------------------------------------------------

PREFIX = "arena_"
"""What every token begins with, so that whoever finds one knows what it is."""

DAYS = (1, 7, 30, 90, 365)
"""How long a token may work."""

MOST_ALIVE = 50
"""So many tokens one account may have at once."""

WINDOW = timedelta(minutes=1)


REQUESTS = {"admin": 1200, "researcher": 1200, "expert": 600, "entrant": 600}
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
        role: One of `TOKEN_ROLES` of the owner's role.
        days: How long it works, one of `DAYS`.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        UnknownName: The role is none that the owner may give.
        Conflict: It is to work for another time, or the owner has too many.
    """
    name = one_line("name", name, what="token", longest=80)
    offered = TOKEN_ROLES.get(top_role(owner) or "", ())
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
    _log_token(token, "add", owner)
    return FreshToken(token=token, secret=secret)


@transaction.atomic
def revoke_api_token(*, token: ApiToken, actor: User | None) -> None:
    """Revoke a token; twice changes nothing."""
    if ApiToken.objects.filter(pk=token.pk, revoked_at=None).update(revoked_at=timezone.now()):
        _log_token(token, "revoke", actor)


def _log_token(token: ApiToken, verb: str, actor: User | None) -> None:
    facts = {"name": token.name, "role": token.role, "owner": str(token.owner.person.code)}
    log_change(token, verb, actor, after=facts | {"expires_at": token.expires_at.isoformat()})


def use_api_token(secret: str) -> tuple[User, ApiToken]:
    """Return the owner of a token, with its role as `token_role`; the request is counted.

    Raises:
        TokenOver: It is nobody's, over, or its owner may do nothing of the kind any more.
        TooManyRequests: More requests than its role has within the window.
    """
    alive = ApiToken.objects.select_related("owner").filter(
        revoked_at=None, expires_at__gt=timezone.now(), owner__is_active=True
    )
    token = alive.filter(token_sha256=token_digest(secret)).first()
    role = None if token is None else effective_role(token.role, top_role(token.owner))
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
