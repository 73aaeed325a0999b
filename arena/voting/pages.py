"""The page on which an expert votes. It tells nothing of who made what."""

import math
import uuid
from collections.abc import Callable
from functools import wraps
from typing import Any

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, JsonResponse
from django.shortcuts import redirect, render
from django.urls import reverse
from django.utils.translation import gettext as _
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import AlreadyDecided, InvalidVote, NotYours, StudyNotOpen, TooFast
from arena.models import PracticePair, Study
from arena.site.access import ADMIN, EXPERT, allow_only, user_of
from arena.site.pictures import picture_response
from arena.studies.queries import voting_study
from arena.studies.services.experts import (
    answer_practice,
    is_due,
    practice_pairs,
    report,
    skip_practice,
)
from arena.voting.forms import ReportForm, VoteForm
from arena.voting.queries.ballots import skipped_pairs
from arena.voting.queries.showings import (
    drives_of_pair,
    lane_edges_of_pair,
    measures_of_pair,
    picture_shown,
)
from arena.voting.screen import over_context, vote_context
from arena.voting.services.casting import receive_vote
from augment.errors import Conflict
from augment.services.judging.findings import (
    EGO_ID,
    Finding,
    FindingKind,
    LaneEdges,
    check_augmentation,
)

View = Callable[..., HttpResponseBase]


def strangers_find_nothing(view: View) -> View:
    """Answer 404 for what is somebody else's, as for what does not exist."""

    @wraps(view)
    def answer(*args: Any, **named: Any) -> HttpResponseBase:
        try:
            return view(*args, **named)
        except NotYours as error:
            raise Http404 from error

    return answer


@allow_only(EXPERT)
@strangers_find_nothing
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def vote_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next pair, or with `change` one that was decided.

    A vote that comes by the form is saved and followed by a redirect, so that back and reload
    are safe; with a script votes go to the wire instead.
    """
    study = _study_of(request, code)
    if request.method == "POST":
        return _save(request, study)
    if is_due(study, user_of(request)):
        return redirect("vote-practice", code=study.code)
    return _show(request, study)


@allow_only(EXPERT)
@strangers_find_nothing
@require_safe
def help_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """How to vote, for those without a script; with one it is a panel of the voting page."""
    study = _study_of(request, code)
    return render(request, "vote/help.html", over_context(study, user_of(request)))


@allow_only(EXPERT)
@strangers_find_nothing
@never_cache
@require_safe
def skipped_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The pairs that the expert skipped: each can be looked at again and voted on."""
    study = _study_of(request, code)
    expert = user_of(request)
    context = over_context(study, expert)
    context["skips"] = skipped_pairs(study=study, expert=expert)
    return render(request, "vote/skipped.html", context)


@require_POST
@allow_only(EXPERT)
@strangers_find_nothing
def report_pair(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Keep what is wrong with a pair, then show it again."""
    study = _study_of(request, code)
    form = ReportForm(request.POST)
    if not form.is_valid():
        messages.error(request, _("That could not be read; nothing was reported."))
        return redirect("vote", code=study.code)
    given = form.cleaned_data
    matchup, key = given["matchup"], given["key"]
    try:
        report(expert=user_of(request), matchup_code=matchup, key=key, said=form.said())
    except StudyNotOpen:
        pass  # the page that follows says that the study is closed
    else:
        messages.success(request, _("Reported, thank you."))
    return redirect("vote", code=study.code)


@allow_only(EXPERT, ADMIN)
@strangers_find_nothing
@require_safe
def matchup_image(request: HttpRequest, token: str) -> HttpResponseBase:
    """One side of a matchup, by a token that says nothing."""
    return picture_response(picture_shown(user=user_of(request), token=token))


@allow_only(EXPERT, ADMIN)
@strangers_find_nothing
@require_safe
def replay(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """How a planner drove both scenes of a pair, for the script that plays it."""
    return _json(drives_of_pair(user=user_of(request), code=code))


@allow_only(EXPERT, ADMIN)
@strangers_find_nothing
@require_safe
def measures(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Lines and rings over a pair, or with x and y (pixels) how far the lane's edges are there."""
    user, place = user_of(request), request.GET
    try:
        if place.keys() & {"x", "y"}:
            x_px, y_px = (float(place.get(name, "")) for name in ("x", "y"))
            if not (math.isfinite(x_px) and math.isfinite(y_px)):
                raise ValueError
            found = lane_edges_of_pair(user=user, code=code, x_px=x_px, y_px=y_px)
            answer = None if found is None else {"words": _edges(found[0])}
        else:
            answer = measures_of_pair(user=user, code=code)
    except ValueError:
        return JsonResponse({"problem": _("x and y are pixels of the picture.")}, status=422)
    return _json(answer)


# Private


def _edges(edges: LaneEdges | None) -> str:
    if edges is None:
        return _("on no lane")
    return _("%(left)s m from the left edge of its lane, %(right)s m from the right") % {
        "left": f"{edges.left_m:.1f}",
        "right": f"{edges.right_m:.1f}",
    }


def _json(answer: dict[str, Any] | None) -> JsonResponse:
    if answer is None:
        raise Http404
    return JsonResponse(answer, headers={"Cache-Control": "private, no-store"})


def _study_of(request: HttpRequest, code: uuid.UUID) -> Study:
    return voting_study(expert=user_of(request), code=code)


def _show(request: HttpRequest, study: Study, status: int = 200) -> HttpResponse:
    """A pair, or why there is none."""
    expert = user_of(request)
    if study.state != Study.State.OPEN:
        return render(request, "vote/closed.html", over_context(study, expert))
    context = vote_context(study, expert, change=request.GET.get("change", ""))
    if context is None:
        return render(request, "vote/done.html", over_context(study, expert))
    return render(request, "vote/vote.html", context, status=status)


def _save(request: HttpRequest, study: Study) -> HttpResponse:
    form = VoteForm(request.POST)
    try:
        if not form.is_valid():
            raise InvalidVote({"outcome": "It is none of the answers."})
        receive_vote(expert=user_of(request), decision=form.decision())
    except InvalidVote:
        messages.error(request, _("That was not one of the answers; nothing was saved."))
        return _show(request, study, status=422)
    except TooFast:
        messages.error(request, _("That was too fast to be read; nothing was saved."))
        return _show(request, study, status=429)
    except (AlreadyDecided, Conflict):
        messages.info(request, _("You had decided that pair before; your first vote counts."))
    except StudyNotOpen:
        pass  # the page that follows says that the study is closed
    return redirect("vote", code=study.code)


MOST_REASONS = 3


@allow_only(EXPERT)
@strangers_find_nothing
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def practice_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next pair to practise on, or with `pair` what was right of one that was answered."""
    expert = user_of(request)
    study = _study_of(request, code)
    if request.method == "POST":
        return _answer(request, study, expert)
    pairs = practice_pairs(study, expert)
    asked = request.GET.get("pair", "")
    told = next((one for one in pairs if str(one.position) == asked and one.answer), None)
    pair = told or next((one for one in pairs if not one.answer), None)
    if study.state != Study.State.OPEN or pair is None:
        return redirect("vote", code=code)
    context = over_context(study, expert) | {
        "pair": pair,
        "pairs": len(pairs),
        "is_told": told is not None,
        "is_last": all(one.answer for one in pairs),
    }
    if told is not None:
        context["reasons"] = _reasons(told)
    return render(request, "vote/practice.html", context)


def _answer(request: HttpRequest, study: Study, expert: User) -> HttpResponse:
    position = request.POST.get("pair", "")
    page = reverse("vote-practice", args=[study.code])
    try:
        if "skip" in request.POST:
            skip_practice(study=study, expert=expert)
            return redirect("vote", code=study.code)
        if not position.isdecimal() or len(position) > 3:
            raise InvalidVote({"pair": "It is no pair of the round."})
        answer = request.POST.get("outcome", "")
        answer_practice(study=study, expert=expert, position=int(position), answer=answer)
    except StudyNotOpen:
        return redirect("vote", code=study.code)  # which says that the study is closed
    except InvalidVote:
        messages.error(request, _("That was not one of the answers; nothing was saved."))
        return redirect(page)
    return redirect(f"{page}?pair={int(position)}")


def _reasons(pair: PracticePair) -> list[str]:
    """Which objects overlap in the broken picture, the worst first: it heaps all on the ego."""
    checked = check_augmentation(pair.broken)
    faults = checked.faults if checked else []
    overlaps = [one for one in faults if one.kind is FindingKind.OVERLAP]
    return [_overlap_in_words(one) for one in overlaps[:MOST_REASONS]]


def _overlap_in_words(finding: Finding) -> str:
    text = (
        _("{0} and the ego overlap by {share:.0%} of the smaller box, {depth:.2f} m deep.")
        if EGO_ID in finding.agents
        else _("{0} and {1} overlap by {share:.0%} of the smaller box, {depth:.2f} m deep.")
    )
    measured = finding.measured
    return text.format(
        *finding.agents, share=measured["share_of_smaller"], depth=measured["depth_m"]
    )
