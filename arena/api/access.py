"""Identity of a request, by a token or a session, and the roles that may use a resource."""

from typing import Any

from django.contrib.auth.models import User
from rest_framework.authentication import BaseAuthentication
from rest_framework.permissions import SAFE_METHODS, BasePermission
from rest_framework.request import Request

from arena.api.tokens import use_api_token
from arena.errors import TokenOver
from arena.models import ApiToken
from arena.shell.accounts import top_role

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
