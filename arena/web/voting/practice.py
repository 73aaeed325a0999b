"""The practice round: one pair after the other, each followed by what was right and why."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import redirect, render
from django.urls import reverse
from django.utils.translation import gettext as _
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods

from arena.errors import InvalidVote, NotYours, StudyNotOpen
from arena.models import PracticePair, Study
from arena.site.access import EXPERT, allow_only
from arena.studies.queries import voting_study
from arena.studies.services.experts import answer_practice, practice_pairs, skip_practice
from arena.voting.screen import over_context
from augment.services.judging.findings import EGO_ID, Finding, FindingKind, check_augmentation

MOST_REASONS = 3


@allow_only(EXPERT)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def practice_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next pair to practise on, or with `pair` what was right of one that was answered."""
    expert = cast(User, request.user)
    try:
        study = voting_study(expert=expert, code=code)
    except NotYours as error:
        raise Http404 from error
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
    faults = [line.finding for line in checked.faults] if checked else []
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
