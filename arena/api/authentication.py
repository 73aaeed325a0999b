"""Who asks: a program by its token, or a browser by its session and CSRF token."""

from __future__ import annotations

from django.contrib.auth.models import User
from rest_framework.authentication import BaseAuthentication
from rest_framework.request import Request

from arena.errors import TokenOver
from arena.models import ApiToken
from arena.services.api_tokens import use_api_token
from augment.sentences import sentence

SCHEME = "bearer"


class BearerToken(BaseAuthentication):
    """`Authorization: Bearer arena_...`; without that header the session decides."""

    def authenticate(self, request: Request) -> tuple[User, ApiToken] | None:
        """The owner, with the token's role, and the token.

        Raises:
            TokenOver: The token opens nothing.
            TooManyRequests: It was used too often.
        """
        scheme, _, secret = request.headers.get("Authorization", "").partition(" ")
        if scheme.lower() != SCHEME:
            return None
        if not secret.strip():
            raise TokenOver(sentence("No token follows the word Bearer."))
        return use_api_token(secret.strip())

    def authenticate_header(self, request: Request) -> str:
        """What a 401 asks for."""
        return "Bearer"
