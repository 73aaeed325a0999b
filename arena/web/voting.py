"""The page on which an expert votes. It tells nothing of who made what."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase
from django.shortcuts import redirect, render
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_safe

from arena.errors import AlreadyDecided, NotYours, StudyNotOpen
from arena.models import Study
from arena.queries.showings import picture_shown
from arena.queries.studies import voting_study
from arena.queries.votes import next_matchup, voting_progress
from arena.services.votes import cast_vote, mark_served
from arena.web.access import ADMIN, EXPERT, only
from arena.web.forms import VoteForm
from arena.web.pictures import picture_response
from augment.errors import Conflict


@only(EXPERT)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def vote_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next pair; a vote is saved and followed by a redirect, so back and reload are safe."""
    expert = cast(User, request.user)
    try:
        study = voting_study(expert=expert, code=code)
    except NotYours as error:
        raise Http404 from error
    if request.method == "POST":
        return _save(request, study, expert)
    return _show(request, study, expert)


@only(EXPERT, ADMIN)
@require_safe
def matchup_image(request: HttpRequest, token: str) -> HttpResponseBase:
    """One side of a matchup, by a token that says nothing."""
    try:
        name = picture_shown(user=cast(User, request.user), token=token)
    except NotYours as error:
        raise Http404 from error
    return picture_response(name)


def _show(request: HttpRequest, study: Study, expert: User, status: int = 200) -> HttpResponse:
    """The next pair, or why there is none."""
    context = {"study": study, "progress": voting_progress(study=study, expert=expert)}
    if study.state == Study.State.CLOSED:
        return render(request, "vote/closed.html", context)
    if study.state == Study.State.DRAFT:
        raise Http404
    matchup = next_matchup(study=study, expert=expert)
    if matchup is None:
        return render(request, "vote/done.html", context)
    mark_served(matchups=[matchup])
    context |= {"matchup": matchup, "key": uuid.uuid4()}
    return render(request, "vote/vote.html", context, status=status)


def _save(request: HttpRequest, study: Study, expert: User) -> HttpResponse:
    form = VoteForm(request.POST)
    if not form.is_valid():
        messages.error(request, "That was not one of the three answers; nothing was saved.")
        return _show(request, study, expert, status=422)
    try:
        cast_vote(
            expert=expert,
            matchup_code=form.cleaned_data["matchup"],
            key=form.cleaned_data["key"],
            outcome=form.cleaned_data["outcome"],
            ms_visible=form.cleaned_data["ms_visible"],
        )
    except NotYours as error:
        raise Http404 from error
    except (AlreadyDecided, Conflict):
        messages.info(request, "You had decided that pair before; your first vote counts.")
    except StudyNotOpen:
        pass  # the page that follows says that the study is closed
    return redirect("vote", code=study.code)
