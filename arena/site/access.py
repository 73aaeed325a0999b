"""Who may open which page, and signing in."""

import json
from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, cast

from django.contrib.auth.forms import AuthenticationForm
from django.contrib.auth.middleware import LoginRequiredMiddleware
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import HttpRequest, HttpResponse, HttpResponseBase, QueryDict
from django.shortcuts import render

from arena.people.queries import has_admin, role_of

P = ParamSpec("P")
View = Callable[Concatenate[HttpRequest, P], HttpResponseBase]

ADMIN, ANALYST, EXPERT = "admin", "analyst", "expert"

STAFF = (ADMIN, ANALYST)
"""Who may know which contestant made what."""

BACKEND = "arena.people.queries.AccountBackend"
GONE = 410
"""The status of a link that is over."""


def allow_only(*roles: str) -> Callable[[View[P]], View[P]]:
    """Refuse other roles with 403; SignInMiddleware stops who is not signed in."""

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


def keep_secret(answer: HttpResponse) -> HttpResponse:
    """Let nobody learn the address of a page that is a key: no referrer, no search engine.

    With "no-referrer" browsers hide the origin of the page's form as well, and it is refused.
    """
    answer["Referrer-Policy"] = "strict-origin"
    answer["X-Robots-Tag"] = "noindex, nofollow"
    return answer


KEPT = "kept_form"
"""The field of the sign-in page that holds what was typed elsewhere."""

_LEFT_OUT = ("csrfmiddlewaretoken", "password")


class SignInMiddleware(LoginRequiredMiddleware):
    """Ask who is not signed in to do so; the sign-in page keeps what they sent."""

    def handle_no_permission(  # type: ignore[override]
        self, request: HttpRequest, view_func: Callable[..., Any]
    ) -> HttpResponseBase:
        """Show the sign-in page in place of the answer to a typed form, else go there."""
        if not request.POST:
            return super().handle_no_permission(request, view_func)
        context = {
            "form": AuthenticationForm(request),
            "next": request.get_full_path(),
            KEPT: keep_form(request.POST),
            "is_empty": not has_admin(),
        }
        return render(request, "login.html", context)


def keep_form(sent: QueryDict) -> str:
    """Return the fields of a form as text, without passwords."""
    fields = {
        name: values
        for name, values in sent.lists()
        if not any(word in name for word in _LEFT_OUT)
    }
    return json.dumps(fields)


def read_form(kept: str) -> list[tuple[str, str]]:
    """Return the names and values of what `keep_form` gave; nothing where it is not of ours."""
    try:
        fields = json.loads(kept)
    except ValueError:
        return []
    if not isinstance(fields, dict):
        return []
    return [
        (name, value)
        for name, values in fields.items()
        if isinstance(values, list)
        for value in values
        if isinstance(value, str)
    ]
