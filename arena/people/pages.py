"""Pages of accounts: sign-in, the list of people, links to set a password, one's own tokens."""

import re
import uuid
from collections.abc import Callable
from functools import wraps
from typing import Any

from django import forms
from django.contrib import messages
from django.contrib.auth import login, update_session_auth_hash
from django.contrib.auth.decorators import login_not_required
from django.contrib.auth.forms import (
    AuthenticationForm,
    PasswordChangeForm,
    SetPasswordForm,
    UsernameField,
)
from django.contrib.auth.models import User
from django.contrib.auth.views import LoginView
from django.db import transaction
from django.db.models import Prefetch
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils import timezone
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy, ngettext
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods

from arena.api.access import DAYS, REQUESTS, make_api_token, revoke_api_token
from arena.errors import LinkOver
from arena.models import ApiToken, Invitation, Study
from arena.people import links, services
from arena.people.queries import by_pseudonym, has_admin, is_forgotten
from arena.shell import access, acts
from arena.shell.accounts import ROLES, TOKEN_ROLES, Language, find_language, role_given, top_role
from arena.shell.forms import offer

ROLE_NAMES = {
    "admin": gettext_lazy("Admin"),
    "researcher": gettext_lazy("Researcher"),
    "expert": gettext_lazy("Expert"),
    "entrant": gettext_lazy("Entrant"),
}
LANGUAGE_COOKIE = "django_language"
"""Django's own name for it, which its locale middleware reads."""

A_YEAR_S = 365 * 24 * 3600
USUAL_DAYS = 30


class AccountForm(forms.Form):
    """New accounts of one role; their owners come in by links."""

    username = forms.CharField(
        max_length=20_000,
        label="Names or mail addresses",
        help_text="One a line. Others see a pseudonym, made up or after a comma: ada, Expert A.",
        widget=forms.Textarea(attrs={"rows": 3, "spellcheck": "false"}),
    )
    role = forms.ChoiceField(
        choices=[(role, ROLE_NAMES[role]) for role in reversed(ROLES)], initial="expert"
    )

    def clean_username(self) -> list[tuple[str, str | None]]:
        """Return usernames, each with its pseudonym if one is given.

        What mail programs and spreadsheets put between and around them is understood.
        """
        lines = filter(str.strip, re.split(r"[\n;]", self.cleaned_data["username"]))
        parts = [re.split(r"[,\t]", line, maxsplit=1) for line in lines]
        return [
            ("-".join(re.sub(r".*<(.+)>.*", r"\1", name).split()), "".join(rest).strip() or None)
            for name, *rest in parts
        ]


class FirstForm(forms.Form):
    """The first admin, with the code that the server has printed."""

    code = forms.CharField(
        max_length=2000,
        help_text="It ends the link that the terminal shows, below the address of this server.",
    )
    username = forms.CharField(max_length=150)
    password = forms.CharField(widget=forms.PasswordInput({"autocomplete": "new-password"}))


class TokenForm(forms.Form):
    """A new token."""

    name = forms.CharField(max_length=80, label=gettext_lazy("What it is for"))
    role = forms.ChoiceField(label=gettext_lazy("Role"))
    days = forms.TypedChoiceField(
        coerce=int, initial=str(USUAL_DAYS), label=gettext_lazy("Works for")
    )

    def __init__(self, data: Any = None, *, roles: tuple[str, ...]) -> None:
        super().__init__(data)
        offer(self, "role", [(name, ROLE_NAMES[name]) for name in roles])
        days = [(str(n), ngettext("%(n)s day", "%(n)s days", n) % {"n": n}) for n in DAYS]
        offer(self, "days", days)


# --- Signing in --------------------------------------------------------------------------------


class SignInForm(AuthenticationForm):
    """Django's, with a username no longer than a failed login is stored with."""

    username = UsernameField(max_length=150)


class SignIn(LoginView):
    """The login; the pages that follow speak the language of the account."""

    template_name = "login.html"
    authentication_form = SignInForm
    redirect_authenticated_user = True

    def get(self, request: HttpRequest, *args: Any, **named: Any) -> HttpResponse:
        """Show the form; where there is no account at all, lead to the page of the first one."""
        if not User.objects.exists():
            return redirect("first")
        return super().get(request, *args, **named)

    def form_valid(self, form: AuthenticationForm) -> HttpResponse:
        """Sign in."""
        return with_own_language(super().form_valid(form), form.get_user())


def with_own_language(answer: HttpResponse, user: User) -> HttpResponse:
    """Set this browser's language to what the account chose, if it chose any."""
    if chosen := find_language(user):
        keep_language(answer, chosen)
    return answer


def keep_language(answer: HttpResponse, language: Language) -> None:
    """Set the cookie that decides before the browser's own wish."""
    answer.set_cookie(
        LANGUAGE_COOKIE, language.value, max_age=A_YEAR_S, httponly=True, samesite="Lax"
    )


def link_page(view: Callable[..., HttpResponse]) -> Callable[..., HttpResponse]:
    """Let a page be opened by its link alone, kept secret; a link that is over says so."""

    @login_not_required
    @never_cache
    @require_http_methods(access.FORM_METHODS)
    @wraps(view)
    def answer(request: HttpRequest, **named: Any) -> HttpResponse:
        try:
            return access.keep_secret(view(request, **named))
        except LinkOver:
            return access.keep_secret(render(request, "people/link_over.html", status=access.GONE))

    return answer


@link_page
def first_page(request: HttpRequest, token: str = "") -> HttpResponse:
    """Create the first admin, by the printed code or by the link that ends with it."""
    if token or has_admin():
        services.check_first_link(token)
    form = FirstForm(request.POST or None, initial={"code": token})
    if form.is_valid():
        with acts.refusals_in(form):
            user = services.make_first_admin(**form.cleaned_data)
            login(request, user, backend=access.BACKEND)
            return redirect("home")
    return render(request, "people/first.html", {"form": form, "token": token})


@link_page
def welcome_page(request: HttpRequest, token: str) -> HttpResponse:
    """Let an account's owner set the password of an account that an admin made."""
    user = services.find_welcomed(token)
    form = SetPasswordForm(user, request.POST or None)
    if form.is_valid():
        password = form.cleaned_data["new_password1"]
        user = services.accept_welcome(token=token, password=password)
        login(request, user, backend=access.BACKEND)
        return redirect("home")
    return render(request, "people/welcome.html", {"form": form, "welcomed": user})


@never_cache
@require_http_methods(access.FORM_METHODS)
def password_page(request: HttpRequest) -> HttpResponse:
    """One's own password; other devices are signed out by a new one."""
    user = access.get_user(request)
    form = PasswordChangeForm(user, request.POST or None)
    if not user.has_usable_password():
        messages.info(request, _("You sign in by a link, not by a password."))
        return redirect("home")
    if form.is_valid():
        update_session_auth_hash(request, form.save())
        messages.success(request, _("Your password is changed; other devices are signed out."))
        return redirect("home")
    return render(request, "people/password.html", {"form": form})


# --- People ------------------------------------------------------------------------------------


@access.form_for(access.ADMIN)
@never_cache
def people_page(request: HttpRequest) -> HttpResponse:
    """Every account, and a form for new ones, all or none, which ends at their links."""
    form = AccountForm(request.POST or None)
    if form.is_valid():
        role, actor = form.cleaned_data["role"], access.get_user(request)
        with acts.refusals_in(form, "username"), transaction.atomic():
            users = [
                services.create_person(
                    username=name, pseudonym=pseudonym, role=role, password=None, actor=actor
                )
                for name, pseudonym in form.cleaned_data["username"]
            ]
            return show_new_links(request, users)
    context = {"lines": _list_accounts(), "form": form, "roles": ROLE_NAMES.items()}
    return render(request, "people/list.html", context)


def _list_accounts() -> list[dict[str, Any]]:
    """Return every account, by role and pseudonym.

    Left out are those that the machine votes for and those that enrolled by a link, which the page
    of their study lists.
    """
    accounts = User.objects.filter(person__is_simulated=False, enrolled=None)
    live = Prefetch("invitations", Invitation.objects.filter(revoked_at=None))
    accounts = accounts.select_related("person").prefetch_related("groups", live)
    places = {role: place for place, role in enumerate((*ROLES, None))}
    by_role = sorted(by_pseudonym(accounts), key=lambda user: places[role_given(user)])
    return [
        {"account": user, "role": role_given(user), "is_forgotten": is_forgotten(user)}
        for user in by_role
    ]


@access.act_for(access.ADMIN, back="people")
@never_cache
def make_link(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """A link for who is new, has forgotten the password or can't come in any more."""
    return show_new_links(request, [find_account(code)])


@access.act_for(access.ADMIN, back="people")
def change_person(request: HttpRequest, code: uuid.UUID) -> None:
    """Pause, resume, take links back, or give another role: what the pressed button says."""
    user, actor = find_account(code), access.get_user(request)
    act = request.POST.get("act", "")
    if act in ("pause", "resume"):
        services.set_active(user=user, is_active=act == "resume", actor=actor)
    elif act == "take-back":
        for invitation in user.invitations.filter(revoked_at=None):
            links.revoke(invitation=invitation, actor=actor)
    else:
        services.set_role(user=user, role=request.POST.get("role", ""), actor=actor)
    messages.success(request, f"{user.person.pseudonym} is changed.")


def find_account(code: uuid.UUID) -> User:
    """Return the account with that code, or answer 404."""
    return get_object_or_404(User.objects.select_related("person"), person__code=code)


def show_new_links(
    request: HttpRequest, owners: list[User], study: Study | None = None
) -> HttpResponse:
    """Make a link for each of these accounts of one role, and show them this once."""
    lines = []
    for owner in owners:
        path = links.make_link_path(owner, study=study, actor=access.get_user(request))
        lines.append((owner, request.build_absolute_uri(path)))
    context = {"study": study, "lines": lines, "is_expert": role_given(owners[0]) == access.EXPERT}
    return render(request, "people/links.html", context, status=access.CREATED)


# --- One's own tokens --------------------------------------------------------------------------


@access.form_for(access.ADMIN, access.RESEARCHER, access.EXPERT, access.ENTRANT)
@never_cache
def tokens_page(request: HttpRequest) -> HttpResponse:
    """One's own tokens, and a form for a new one, which is shown this once."""
    user, now = access.get_user(request), timezone.now()
    roles = TOKEN_ROLES.get(top_role(user) or "", ())
    form = TokenForm(request.POST or None, roles=roles)
    fresh = None
    if form.is_valid():
        with acts.refusals_in(form):
            fresh = make_api_token(owner=user, **form.cleaned_data)
            form = TokenForm(roles=roles)
    context = {
        "form": form,
        "fresh": fresh,
        "lines": [
            (token, token.state(now), ROLE_NAMES[token.role])
            for token in ApiToken.objects.filter(owner=user)
        ],
        "limits": [(ROLE_NAMES[role], REQUESTS[role]) for role in roles],
        "is_staff": roles and roles[0] in access.STAFF,
        "is_admin": access.ADMIN in roles,
    }
    status = 422 if form.errors else access.CREATED if fresh else 200
    return render(request, "api/tokens.html", context, status=status)


@access.act_for(access.ADMIN, access.RESEARCHER, access.EXPERT, access.ENTRANT, back="api-tokens")
def revoke_token(request: HttpRequest, code: uuid.UUID) -> None:
    """Revoke one of one's own tokens."""
    user = access.get_user(request)
    token = get_object_or_404(ApiToken, owner=user, code=code)
    revoke_api_token(token=token, actor=user)
    messages.success(request, _("“%(name)s” opens nothing any more.") % {"name": token.name})
