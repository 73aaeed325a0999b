"""Asking the API as a program does, by a token."""

from django.contrib.auth.models import User
from django.test import Client

from arena.api.access import make_api_token
from arena.shell.accounts import top_role


def secret_of(user: User, role: str | None = None) -> str:
    """A new token, in the most powerful role unless another is named."""
    role = role or top_role(user) or ""
    return make_api_token(owner=user, name="a program", role=role, days=1).secret


def program(secret: str) -> Client:
    """A client without cookies; it keeps to CSRF rules as a browser does."""
    return Client(enforce_csrf_checks=True, headers={"Authorization": f"Bearer {secret}"})


def program_of(user: User, role: str | None = None) -> Client:
    return program(secret_of(user, role))
