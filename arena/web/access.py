"""Who may open which page, said once in front of each view."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, cast

from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import HttpRequest, HttpResponseBase

from arena.queries.people import role_of

P = ParamSpec("P")
View = Callable[Concatenate[HttpRequest, P], HttpResponseBase]

ADMIN, ANALYST, EXPERT = "admin", "analyst", "expert"

STAFF = (ADMIN, ANALYST)
"""Who may know which contestant made what."""


def allow_only(*roles: str) -> Callable[[View[P]], View[P]]:
    """Refuse everybody else with 403; who is not signed in never gets this far."""

    def wrap(view: View[P]) -> View[P]:
        @wraps(view)
        def guarded(
            request: HttpRequest, /, *args: P.args, **kwargs: P.kwargs
        ) -> HttpResponseBase:
            if role_of(request.user) not in roles:
                raise PermissionDenied
            return view(request, *args, **kwargs)

        return guarded

    return wrap


def user_of(request: HttpRequest) -> User:
    """Return who is signed in, for a view that others can't reach."""
    return cast(User, request.user)
