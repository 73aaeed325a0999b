"""Which tokens somebody has, and what they open."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.utils import timezone

from arena.models import ApiToken, token_digest
from arena.queries.people import role_of

OFFERED = {"admin": ("admin", "analyst"), "analyst": ("analyst",), "expert": ("expert",)}
"""The roles that a token may have, by the role of its owner. Staff know too much to vote, so
that theirs is never an expert's."""


def roles_offered(user: User) -> tuple[str, ...]:
    """The roles that a new token of this account may have, the most powerful first."""
    return OFFERED.get(role_of(user) or "", ())


def effective_role(role: str, owner_role: str | None) -> str | None:
    """What a token of that role opens while its owner has that role, None for nothing.

    An admin's token opens what an analyst may once its owner is one.
    """
    offered = OFFERED.get(owner_role or "", ())
    if role in offered:
        return role
    return "analyst" if (role, owner_role) == ("admin", "analyst") else None


def api_tokens_of(user: User) -> list[tuple[ApiToken, ApiToken.State]]:
    """The tokens of an account with their states, the newest first; one query."""
    now = timezone.now()
    return [(token, token.state(now)) for token in ApiToken.objects.filter(owner=user)]


def api_token_by_secret(secret: str) -> ApiToken | None:
    """The token that reads so, with its owner; None where there is none that works."""
    now = timezone.now()
    rows = ApiToken.objects.select_related("owner")
    token = rows.filter(token_sha256=token_digest(secret)).first()
    if token is None or not token.owner.is_active:
        return None
    return token if token.state(now) is ApiToken.State.ALIVE else None
