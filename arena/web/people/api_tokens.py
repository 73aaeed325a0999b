"""Tokens of one's own programs: made, listed, revoked."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy, ngettext
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST

from arena.models import ApiToken
from arena.queries.api_tokens import api_tokens_of, roles_offered
from arena.services.api_tokens import DAYS, REQUESTS, make_api_token, revoke_api_token
from arena.site.access import ADMIN, ANALYST, EXPERT, STAFF, allow_only
from arena.web.people.accounts import ROLE_NAMES
from augment.errors import AugmentError

USUAL_DAYS = 30


class TokenForm(forms.Form):
    """A new token."""

    name = forms.CharField(max_length=80, label=gettext_lazy("What it is for"))
    role = forms.ChoiceField(label=gettext_lazy("Role"))
    days = forms.TypedChoiceField(
        coerce=int, initial=str(USUAL_DAYS), label=gettext_lazy("Works for")
    )

    def __init__(self, data: Any = None, *, roles: tuple[str, ...]) -> None:
        super().__init__(data)
        role, days = (cast(forms.ChoiceField, self.fields[name]) for name in ("role", "days"))
        role.choices = [(one, ROLE_NAMES[one]) for one in roles]
        days.choices = [(str(n), ngettext("%(n)s day", "%(n)s days", n) % {"n": n}) for n in DAYS]


@allow_only(ADMIN, ANALYST, EXPERT)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def tokens_page(request: HttpRequest) -> HttpResponse:
    """One's own tokens, and a form for a new one, which is shown this once."""
    user = cast(User, request.user)
    roles = roles_offered(user)
    form = TokenForm(request.POST if request.method == "POST" else None, roles=roles)
    fresh = None
    if request.method == "POST" and form.is_valid():
        try:
            fresh = make_api_token(owner=user, **form.cleaned_data)
        except AugmentError as error:
            form.add_error(None, str(error))
        else:
            form = TokenForm(roles=roles)
    context = {
        "form": form,
        "fresh": fresh,
        "lines": [(*line, ROLE_NAMES[line[0].role]) for line in api_tokens_of(user)],
        "limits": [(ROLE_NAMES[role], REQUESTS[role]) for role in roles],
        "is_staff": roles and roles[0] in STAFF,
        "is_admin": ADMIN in roles,
    }
    status = 422 if form.errors else 200
    return render(request, "api/tokens.html", context, status=status)


@allow_only(ADMIN, ANALYST, EXPERT)
@require_POST
def revoke(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Let one of one's own tokens open nothing any more."""
    user = cast(User, request.user)
    token = get_object_or_404(ApiToken, owner=user, code=code)
    revoke_api_token(token=token, actor=user)
    messages.success(request, _("“%(name)s” opens nothing any more.") % {"name": token.name})
    return redirect("api-tokens")
