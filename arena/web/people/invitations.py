"""Inviting experts to a study, and the page on which an invitation is accepted."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth import login
from django.contrib.auth.decorators import login_not_required
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils import timezone
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import ArenaError, LinkOver, NotYours
from arena.models import Invitation, Study
from arena.queries.studies.authorships import authorships_of
from arena.queries.studies.invitations import expert_lines, invitation_by_token, may_be_let_in
from arena.services.invitations import SESSION_KEY, FreshLink, accept, invite, revoke
from arena.site.access import ADMIN, allow_only
from arena.web.people.authorships import AuthorForm
from arena.web.people.sign_in import with_own_language
from augment.errors import AugmentError

SESSION_S = 30 * 24 * 3600
BACKEND = "arena.queries.accounts.AccountBackend"
GONE = 410
LINK_COOKIE = "arena_link"


@login_not_required
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def invitation_page(request: HttpRequest, token: str) -> HttpResponse:
    """Who invited whom to what. Only the button signs in: mail scanners open links, too."""
    try:
        invitation = invitation_by_token(token)
    except NotYours as error:
        raise Http404 from error
    answer = _let_in(request, token) if request.method == "POST" else _landing(request, invitation)
    # The address is the key: no request names it as where it came from, and no search engine keeps
    # it. (With "no-referrer" browsers hide the origin of the form as well, and it is refused.)
    answer["Referrer-Policy"] = "strict-origin"
    answer["X-Robots-Tag"] = "noindex, nofollow"
    return answer


@allow_only(ADMIN)
@never_cache
@require_safe
def experts_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Every expert of a study: progress, pace, quota, last seen, link, and who is an author."""
    study = get_object_or_404(Study, code=code)
    now = timezone.now()
    lines = expert_lines(study, now)
    context = {
        "study": study,
        "lines": lines,
        "without_link": sum(line.may_be_invited and not line.has_live_link for line in lines),
        "authorships": authorships_of(study),
        "author_form": AuthorForm(study=study),
    }
    return render(request, "studies/experts.html", context)


@allow_only(ADMIN)
@never_cache
@require_POST
def invite_experts(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Make links, for one expert or for all without one, and show them this once."""
    study = get_object_or_404(Study, code=code)
    lines = expert_lines(study, timezone.now())
    wanted = request.POST.get("expert")
    if wanted:
        chosen = [line for line in lines if str(line.tally.expert.person.code) == wanted]
    else:
        chosen = [line for line in lines if line.may_be_invited and not line.has_live_link]
    if not chosen:
        messages.info(request, "Nobody was left to invite; no link was made.")
        return redirect("experts", code=study.code)
    try:
        made = [
            _shown(
                request,
                invite(study=study, expert=line.tally.expert, actor=cast(User, request.user)),
            )
            for line in chosen
        ]
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
        return redirect("experts", code=study.code)
    return render(request, "studies/links.html", {"study": study, "links": made})


@allow_only(ADMIN)
@require_POST
def revoke_invitation(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take one link back; whoever came in by it is signed out."""
    invitation = get_object_or_404(Invitation.objects.select_related("study"), code=code)
    revoke(invitation=invitation, actor=cast(User, request.user))
    name = invitation.expert.person.pseudonym
    messages.success(request, f"The link of {name} was taken back.")
    return redirect("experts", code=invitation.study.code)


def _landing(request: HttpRequest, found: Invitation) -> HttpResponse:
    state = found.state(timezone.now())
    if state not in Invitation.ALIVE or not may_be_let_in(found.expert):
        return _over(request, found)
    return render(request, "invitation.html", {"invitation": found, "host": _host(found)})


def _over(request: HttpRequest, found: Invitation) -> HttpResponse:
    state = found.state(timezone.now())
    context = {"is_expired": state == Invitation.State.EXPIRED, "host": _host(found)}
    return render(request, "invitation_over.html", context, status=GONE)


def _let_in(request: HttpRequest, token: str) -> HttpResponse:
    try:
        invitation = accept(token=token)
    except LinkOver:
        return _over(request, invitation_by_token(token))
    login(request, invitation.expert, backend=BACKEND)
    request.session[SESSION_KEY] = str(invitation.code)
    request.session.set_expiry(SESSION_S)
    is_open = invitation.study.state == Study.State.OPEN
    answer = redirect("vote", code=invitation.study.code) if is_open else redirect("home")
    # Shown on the sign-in page alone, when this session is over.
    answer.set_cookie(
        LINK_COOKIE,
        token,
        max_age=SESSION_S,
        httponly=True,
        secure=request.is_secure(),
        samesite="Lax",
    )
    return with_own_language(answer, invitation.expert)


def _host(invitation: Invitation) -> str | None:
    """The name of who invited, None where the command did."""
    by = invitation.invited_by
    if by is None:
        return None
    return by.get_full_name() or (by.person.pseudonym if hasattr(by, "person") else by.username)


def _shown(request: HttpRequest, fresh: FreshLink) -> dict[str, object]:
    path = reverse("invitation", args=[fresh.token])
    return {"invitation": fresh.invitation, "address": request.build_absolute_uri(path)}
