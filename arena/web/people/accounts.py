"""Accounts: who there is, new ones by link, and what an admin does with them."""

from __future__ import annotations

import uuid
from typing import cast

from django import forms
from django.contrib import messages
from django.contrib.auth import login, update_session_auth_hash
from django.contrib.auth.decorators import login_not_required
from django.contrib.auth.forms import PasswordChangeForm, SetPasswordForm
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST

from arena.errors import ArenaError, LinkOver
from arena.queries.people import ROLES, list_accounts
from arena.services.accounts import (
    accept_welcome,
    find_welcomed,
    forget_identity,
    make_welcome_token,
    set_active,
    set_role,
)
from arena.services.first_start import check_first_link, make_first_admin
from arena.services.people import create_person
from arena.site.access import ADMIN, allow_only
from arena.site.acts import Confirmation, ask, is_sure
from arena.web.people.invitations import BACKEND, GONE
from augment.errors import AugmentError

PAGES = ["GET", "HEAD", "POST"]
ROLE_NAMES = {
    "admin": gettext_lazy("Admin"),
    "analyst": gettext_lazy("Analyst"),
    "expert": gettext_lazy("Expert"),
}


class AccountForm(forms.Form):
    """A new account; its owner sets the password by a link."""

    username = forms.CharField(max_length=150, label=gettext_lazy("Username"))
    pseudonym = forms.CharField(
        max_length=60, required=False, label=gettext_lazy("Pseudonym (what others see)")
    )
    role = forms.ChoiceField(
        choices=[(role, ROLE_NAMES[role]) for role in reversed(ROLES)], label=gettext_lazy("Role")
    )


class FirstForm(SetPasswordForm):  # type: ignore[type-arg] # it takes none at run time
    """The name and the password of the first admin."""

    username = forms.CharField(max_length=150, label=gettext_lazy("Username"))
    field_order = ("username", "new_password1", "new_password2")


@allow_only(ADMIN)
@never_cache
@require_http_methods(PAGES)
def people_page(request: HttpRequest) -> HttpResponse:
    """Every account, and a form for a new one, which ends at its link."""
    form = AccountForm(request.POST if request.method == "POST" else None)
    if request.method == "POST" and form.is_valid():
        chosen = form.cleaned_data
        try:
            user = create_person(
                username=chosen["username"],
                password=None,
                role=chosen["role"],
                pseudonym=chosen["pseudonym"] or None,
                actor=cast(User, request.user),
            )
        except (ArenaError, AugmentError) as error:
            form.add_error(None, str(error))
        else:
            return _link_page(request, user)
    lines = [(line, ROLE_NAMES.get(line.role or "", "")) for line in list_accounts()]
    context = {"lines": lines, "form": form, "roles": ROLE_NAMES.items()}
    return render(request, "people/list.html", context)


@allow_only(ADMIN)
@never_cache
@require_POST
def make_link(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """A link to set a password, for who is new or has forgotten it."""
    return _link_page(request, _account(code))


@allow_only(ADMIN)
@require_POST
def change_person(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Pause, resume, or give another role: what the pressed button says."""
    user, actor = _account(code), cast(User, request.user)
    act = request.POST.get("act", "")
    try:
        if act in ("pause", "resume"):
            set_active(user=user, is_active=act == "resume", actor=actor)
        else:
            set_role(user=user, role=request.POST.get("role", ""), actor=actor)
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    else:
        messages.success(request, _("%(name)s is changed.") % {"name": user.person.pseudonym})
    return redirect("people")


@allow_only(ADMIN)
@require_http_methods(PAGES)
def forget_person(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Ask, then take the identity from an account."""
    user = _account(code)
    name = user.person.pseudonym
    if not is_sure(request):
        return ask(
            request,
            Confirmation(
                title=_("Forget who %(name)s is?") % {"name": name},
                facts=(
                    _("Username, pseudonym, preferences and links go; nobody can sign in."),
                    _("Votes and labels stay and count on, under a number."),
                    _("Ratings that are frozen keep the old pseudonym. There is no way back."),
                ),
                button=_("Forget the identity"),
                back=reverse("people"),
                crumbs=((_("People"), reverse("people")),),
            ),
        )
    try:
        forget_identity(user=user, actor=cast(User, request.user))
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    else:
        messages.success(request, _("%(name)s is forgotten.") % {"name": name})
    return redirect("people")


@login_not_required
@never_cache
@require_http_methods(PAGES)
def first_page(request: HttpRequest, token: str) -> HttpResponse:
    """The page of the link that `serve` prints where there is no admin yet."""
    try:
        check_first_link(token)
        form = FirstForm(User(), request.POST if request.method == "POST" else None)
        if request.method == "POST" and form.is_valid():
            user = make_first_admin(
                token=token,
                username=form.cleaned_data["username"],
                password=form.cleaned_data["new_password1"],
            )
            return _let_in(request, user)
    except LinkOver:
        return _keep_secret(render(request, "people/link_over.html", status=GONE))
    except (ArenaError, AugmentError) as error:
        form.add_error("username", str(error))
    context = {"form": form, "is_first": True}
    return _keep_secret(render(request, "people/welcome.html", context))


@login_not_required
@never_cache
@require_http_methods(PAGES)
def welcome_page(request: HttpRequest, token: str) -> HttpResponse:
    """Where somebody sets the password of an account that was made for them."""
    try:
        user = find_welcomed(token)
        form = SetPasswordForm(user, request.POST if request.method == "POST" else None)
        if request.method == "POST" and form.is_valid():
            password = form.cleaned_data["new_password1"]
            return _let_in(request, accept_welcome(token=token, password=password))
    except LinkOver:
        return _keep_secret(render(request, "people/link_over.html", status=GONE))
    context = {"form": form, "welcomed": user}
    return _keep_secret(render(request, "people/welcome.html", context))


@never_cache
@require_http_methods(PAGES)
def password_page(request: HttpRequest) -> HttpResponse:
    """One's own password; other devices are signed out by a new one."""
    user = cast(User, request.user)
    form = PasswordChangeForm(user, request.POST if request.method == "POST" else None)
    if not user.has_usable_password():
        messages.info(request, _("You sign in by a link, not by a password."))
        return redirect("home")
    if request.method == "POST" and form.is_valid():
        update_session_auth_hash(request, form.save())
        messages.success(request, _("Your password is changed; other devices are signed out."))
        return redirect("home")
    return render(request, "people/password.html", {"form": form})


def _account(code: uuid.UUID) -> User:
    return get_object_or_404(User.objects.select_related("person"), person__code=code)


def _link_page(request: HttpRequest, user: User) -> HttpResponse:
    try:
        token = make_welcome_token(user, actor=cast(User, request.user))
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
        return redirect("people")
    address = request.build_absolute_uri(reverse("welcome", args=[token]))
    return render(request, "people/link.html", {"made": user, "address": address})


def _let_in(request: HttpRequest, user: User) -> HttpResponse:
    login(request, user, backend=BACKEND)
    return redirect("home")


def _keep_secret(answer: HttpResponse) -> HttpResponse:
    """The address is the key: see `invitation_page`."""
    answer["Referrer-Policy"] = "strict-origin"
    answer["X-Robots-Tag"] = "noindex, nofollow"
    return answer
