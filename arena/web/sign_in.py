"""Signing in by password, and the language that a person brings along."""

from __future__ import annotations

from django.contrib.auth.forms import AuthenticationForm
from django.contrib.auth.models import User
from django.contrib.auth.views import LoginView
from django.http import HttpResponse

from arena.queries.profiles import Language, language_of

LANGUAGE_COOKIE = "django_language"
"""Django's own name for it, which its locale middleware reads."""

A_YEAR_S = 365 * 24 * 3600


class SignIn(LoginView):
    """The login; the pages that follow speak the language of the account."""

    template_name = "login.html"
    redirect_authenticated_user = True

    def form_valid(self, form: AuthenticationForm) -> HttpResponse:
        """Sign in."""
        answer = super().form_valid(form)
        return with_own_language(answer, form.get_user())


def with_own_language(answer: HttpResponse, user: User) -> HttpResponse:
    """Let this browser speak what the account chose; without a choice it is left as it is."""
    chosen = language_of(user)
    if chosen is not None:
        keep_language(answer, chosen)
    return answer


def keep_language(answer: HttpResponse, language: Language) -> None:
    """Set the cookie that decides before the browser's own wish."""
    answer.set_cookie(
        LANGUAGE_COOKIE, language.value, max_age=A_YEAR_S, httponly=True, samesite="Lax"
    )
