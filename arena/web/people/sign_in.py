"""Signing in by password, and the language that a person brings along."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.forms import AuthenticationForm
from django.contrib.auth.models import User
from django.contrib.auth.views import LoginView
from django.http import HttpResponse
from django.shortcuts import render

from arena.queries.people import has_admin
from arena.queries.profiles import Language, language_of
from arena.site.access import KEPT, read_form

LANGUAGE_COOKIE = "django_language"
"""Django's own name for it, which its locale middleware reads."""

A_YEAR_S = 365 * 24 * 3600


class SignIn(LoginView):
    """The login; the pages that follow speak the language of the account."""

    template_name = "login.html"
    redirect_authenticated_user = True

    def get_context_data(self, **more: Any) -> dict[str, Any]:
        """Whether the first admin is still to be made, and what was typed elsewhere."""
        kept = self.request.POST.get(KEPT, "")
        more |= {KEPT: kept, "is_empty": not has_admin()}
        return super().get_context_data(**more)

    def form_valid(self, form: AuthenticationForm) -> HttpResponse:
        """Sign in; what was typed before the session expired is shown to be sent again."""
        answer = super().form_valid(form)
        if fields := read_form(self.request.POST.get(KEPT, "")):
            context = {"fields": fields, "address": self.get_success_url()}
            answer = render(self.request, "kept_form.html", context)
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
