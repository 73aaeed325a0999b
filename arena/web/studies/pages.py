"""Pages of studies for admins and analysts: progress, never who leads."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import ArenaError
from arena.models import Study
from arena.queries.listings import Narrowing, find_studies
from arena.queries.people import by_pseudonym, experts
from arena.queries.studies import progress
from arena.queries.studies.coverage import coverage, reports_of
from arena.queries.studies.drafts import find_drafts
from arena.queries.votes.judged import is_imported
from arena.queries.voting.ballots import tallies
from arena.services.handing_over import hand_over
from arena.services.hypotheses import hypotheses_of
from arena.services.preregistration import preregistration_bytes, preregistration_sha256
from arena.services.studies import cancel_study, close_study
from arena.services.study_plan import PLAN_INPUTS, plan_of
from arena.site.access import ADMIN, STAFF, allow_only
from arena.site.acts import WHY, ask, is_sure, is_typed, wants_to_change
from arena.site.listing import read_listing, read_page, said_choices
from arena.web.results.rating import rate_or_send
from arena.web.studies.files import export_place
from arena.web.studies.forms import HandOverForm
from arena.web.studies.study_questions import cancelling, closing, handing_over
from augment.errors import AugmentError
from augment.services.inputs import InputKind

STUDIES_AT_ONCE = 25

DRAFT = "draft"
"""What the list calls the state of a study that is still set up."""


@allow_only(*STAFF)
@require_safe
def studies_page(request: HttpRequest) -> HttpResponse:
    """Studies with their bars, page by page; before the first ones the drafts."""
    states = [(DRAFT, "Draft"), *said_choices(Study.State.choices)]
    listing = read_listing(request, {"state": ("State", states)})
    wanted = Narrowing(search=listing.search, kind=listing.chosen("state"))
    page = read_page(request, find_studies(wanted), size=STUDIES_AT_ONCE)
    shows_drafts = page.number == 1 and wanted.kind in ("", DRAFT)
    context = {
        "studies": progress.of_studies(list(page.object_list)),
        "drafts": list(find_drafts(wanted.search)) if shows_drafts else [],
        "page": page,
        "listing": listing,
    }
    return render(request, "studies/list.html", context)


@allow_only(*STAFF)
@require_safe
def study_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The rules, and how far each expert is."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if is_imported(study):
        return redirect("results", code=code)
    context = {
        "line": progress.of_study(study),
        "export": export_place(study, cast(User, request.user)),
        "tallies": tallies(study),
        "contestants": list(study.contestants.all()),
        "scenario_count": study.scenarios.count(),
        "rules": _shown_rules(study),
        "targets": plan_of(study).targets,
        "coverage": coverage(study),
        "reports": list(reports_of(study)),
        "accounts": by_pseudonym(experts()),
        "hypotheses": hypotheses_of(study),
        "frozen": preregistration_sha256(study),
    }
    return render(request, "studies/study.html", context)


@allow_only(*STAFF)
@require_safe
def preregistration_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What was frozen at the opening, byte for byte."""
    study = get_object_or_404(Study, code=code)
    content = preregistration_bytes(study)
    if not content:
        raise Http404
    name = f"{slugify(study.name) or 'study'}-preregistration.json"
    return HttpResponse(
        content,
        content_type="application/json",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@allow_only(ADMIN)
@require_POST
def hand_over_pairs(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Let others judge what an expert has not judged; asks first."""
    study = get_object_or_404(Study, code=code)
    if wants_to_change(request):
        return redirect("study", code=code)
    form = HandOverForm(
        request.POST,
        givers=list(study.experts.values_list("username", flat=True)),
        takers=[user.username for user in experts()],
    )
    if not form.is_valid():
        for problems in form.errors.values():
            messages.error(request, " ".join(map(str, problems)))
        return redirect("study", code=code)
    giver, takers = form.cleaned_data["giver"], form.cleaned_data["takers"]
    try:
        if not is_sure(request):
            return ask(request, handing_over(study, giver, takers))
        taken = hand_over(study=study, username=giver, to=takers, actor=cast(User, request.user))
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    else:
        shares = ", ".join(f"{name} {votes}" for name, votes in taken.items())
        messages.success(request, f"Handed over: {shares}.")
    return redirect("study", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def close(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more votes, rate them with the defaults and show the table; asks first."""
    study = get_object_or_404(Study, code=code)
    if not is_sure(request):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        return ask(request, closing(study))
    actor = cast(User, request.user)
    try:
        closed = close_study(study=study, actor=actor)
        if study.state == Study.State.OPEN:  # not pressed twice
            rate_or_send(request, closed, actor=actor)
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
        return redirect("study", code=code)
    return redirect("results", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def cancel(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Give the study up, without results; its name has to be typed."""
    study = get_object_or_404(Study, code=code)
    if not is_typed(request, study.name):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        return ask(request, cancelling(study))
    try:
        why = request.POST.get(WHY, "")
        cancel_study(study=study, why=why, actor=cast(User, request.user))
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "Cancelled. Its votes stay.")
    return redirect("study", code=code)


# --- Private -----------------------------------------------------------------------------------


def _shown_rules(study: Study) -> list[tuple[str, str]]:
    """Labels and values of what was asked for, but for names and lines."""
    study_plan = plan_of(study)
    return [
        (one.label, one.shown(getattr(study_plan, one.name)))
        for one in PLAN_INPUTS
        if one.kind not in (InputKind.TEXT, InputKind.NAMES, InputKind.LINES)
    ]
