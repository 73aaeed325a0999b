"""The page on which an expert votes. It tells nothing of who made what."""

import uuid

from django.contrib import messages
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.translation import gettext as _
from django.views.decorators.cache import never_cache

from arena.errors import InvalidVote, StudyNotOpen
from arena.models import Study, Vote
from arena.shell.access import ADMIN, EXPERT, form_for, get_user, page_for
from arena.shell.pictures import send_picture
from arena.shell.sending import send_pictures
from arena.voting.queries.ballots import is_being_drawn, own_votes
from arena.voting.queries.keys import KEYS, voting_switches
from arena.voting.queries.showings import drives_of_pair, picture_shown
from arena.voting.screen import no_pair_context, vote_context
from arena.voting.services.practice import answer_practice, is_due, practice_pairs, skip_practice


@page_for(EXPERT)
@never_cache
def vote_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next pair, or with `change` one that was decided; votes go to the API."""
    expert, study = get_user(request), _find_study(request, code)
    if study.state != Study.State.OPEN:
        return render(request, "vote/closed.html", no_pair_context(study, expert))
    if is_due(study, expert):
        return redirect("vote-practice", code=study.code)
    context = vote_context(study, expert, change=request.GET.get("change", ""))
    if context is None:
        context = no_pair_context(study, expert)
        if not context["progress"].left:
            return render(request, "vote/done.html", context)
        if not is_being_drawn(study):
            send_pictures(study.pk)
        return render(request, "vote/waiting.html", context)
    return render(request, "vote/vote.html", context)


@page_for(EXPERT)
@never_cache
def list_skipped_pairs(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The pairs that the expert skipped: each can be looked at again and voted on."""
    expert, study = get_user(request), _find_study(request, code)
    skips = own_votes(study, expert).filter(outcome=Vote.Outcome.SKIP)
    return render(request, "vote/skipped.html", no_pair_context(study, expert) | {"skips": skips})


@page_for(EXPERT, ADMIN)
def matchup_image(request: HttpRequest, token: str) -> HttpResponseBase:
    """One side of a matchup or its film, by a token that says nothing."""
    return send_picture(request, picture_shown(user=get_user(request), token=token))


@page_for(EXPERT, ADMIN)
def replay(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Return a planner's drives of both scenes of a pair, for the script that plays them."""
    drives = drives_of_pair(user=get_user(request), code=code)
    if drives is None:
        raise Http404
    return JsonResponse(drives, headers={"Cache-Control": "private, no-store"})


@form_for(EXPERT)
@never_cache
def practice_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next pair to practise on, or with `pair` what was right of one that was answered."""
    expert, study = get_user(request), _find_study(request, code)
    if request.method == "POST":
        return _practise(request, study)
    pairs = practice_pairs(study, expert)
    position = request.GET.get("pair", "")
    answered = next(
        (pair for pair in pairs if str(pair.position) == position and pair.answer), None
    )
    pair = answered or next((pair for pair in pairs if not pair.answer), None)
    if study.state != Study.State.OPEN or pair is None:
        return redirect("vote", code=code)
    context = no_pair_context(study, expert) | {
        "pair": pair,
        "pairs": len(pairs),
        "preferences": {**voting_switches(expert), "keys": KEYS},
        "is_told": answered is not None,
        "is_last": all(pair.answer for pair in pairs),
    }
    return render(request, "vote/practice.html", context)


def _practise(request: HttpRequest, study: Study) -> HttpResponse:
    expert, form = get_user(request), request.POST
    page = reverse("vote-practice", args=[study.code])
    # Practice asks which picture is right; neither is as wrong as equal.
    answer = "equal" if form.get("outcome") == "both_miss" else form.get("outcome")
    try:
        if "skip" in form:
            skip_practice(study=study, expert=expert)
            return redirect("vote", code=study.code)
        pair = answer_practice(
            study=study, expert=expert, position=form.get("pair"), answer=answer
        )
    except StudyNotOpen:
        return redirect("vote", code=study.code)  # which says that the study is closed
    except InvalidVote:
        messages.error(request, _("That was not one of the answers; nothing was saved."))
        return redirect(page)
    return redirect(f"{page}?pair={pair.position}")


def _find_study(request: HttpRequest, code: uuid.UUID) -> Study:
    return get_object_or_404(get_user(request).studies, code=code)
