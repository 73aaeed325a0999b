"""Pages of studies for admins and analysts: progress, never who leads."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.utils.translation import gettext as _
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena import tasks
from arena.errors import ArenaError
from arena.models import Study
from arena.queries import progress, scenarios
from arena.queries.coverage import coverage, reports_of
from arena.queries.inventory import usual_checks
from arena.queries.judged import is_imported
from arena.queries.listings import Narrowing, find_studies
from arena.queries.people import by_pseudonym, experts
from arena.queries.results import latest_snapshot
from arena.queries.votes import tallies
from arena.services.handing_over import hand_over
from arena.services.hypotheses import hypotheses_of
from arena.services.looks import stopping_progress
from arena.services.practice import has_practice
from arena.services.preregistration import preregistration_bytes, preregistration_sha256
from arena.services.studies import close_study, open_study, rules_of
from arena.web.access import ADMIN, STAFF, allow_only
from arena.web.listing import read_listing, read_page, said_choices
from arena.web.questions import ask, is_sure, wants_to_change
from arena.web.study_forms import HandOverForm, StudyForm
from arena.web.study_questions import closing, handing_over, opening
from augment.errors import AugmentError
from augment.models import Contestant, GenerationJob
from augment.services.wording import translate

_PLANNED = ("votes_per_expert", "repeats", "checks", "overlap")
"""What the planning page hands on to a new study."""


STUDIES_AT_ONCE = 25


@allow_only(*STAFF)
@require_safe
def studies_page(request: HttpRequest) -> HttpResponse:
    """Studies with their bars, page by page."""
    listing = read_listing(request, {"state": (_("State"), said_choices(Study.State.choices))})
    wanted = Narrowing(search=listing.search, kind=listing.chosen("state"))
    page = read_page(request, find_studies(wanted), size=STUDIES_AT_ONCE)
    context = {
        "studies": progress.of_studies(list(page.object_list)),
        "page": page,
        "listing": listing,
    }
    return render(request, "studies/list.html", context)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_study_page(request: HttpRequest) -> HttpResponse:
    """Who competes on what, and who judges; opening plans every matchup."""
    form = StudyForm(
        request.POST or None,
        contestants=list(
            Contestant.objects.exclude(kind=Contestant.Kind.CHECK)
            .filter(retired_at=None)
            .select_related("endpoint")
            .order_by("name")
        ),
        groups=scenarios.by_type(),
        experts=by_pseudonym(experts()),
        jobs=list(GenerationJob.objects.all()),
        initial=_planned_numbers(request),
    )
    if request.method == "POST" and form.is_valid() and not wants_to_change(request):
        try:
            if not is_sure(request):
                return ask(request, opening(form.rules()))
            study = open_study(**form.rules(), actor=cast(User, request.user))
        except (ArenaError, AugmentError) as error:
            form.add_error(None, translate(error))
        else:
            messages.success(
                request, _("“%(name)s” is open; its experts can vote now.") % {"name": study.name}
            )
            return redirect("study", code=study.code)
    return render(request, "studies/new.html", {"form": form}, status=422 if form.errors else 200)


@allow_only(ADMIN)
@require_POST
def draw_checks(request: HttpRequest) -> HttpResponse:
    """Have workers draw the attention checks that are missing; twice does no harm."""
    try:
        tasks.send_checks(cast(User, request.user).pk)
    except AugmentError as error:
        messages.error(request, translate(error))
    else:
        messages.success(
            request, _("Attention checks are being drawn. Reload this page in a moment.")
        )
    return redirect("study-new")


@allow_only(*STAFF)
@require_safe
def study_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The rules, and how far each expert is."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if is_imported(study):
        return redirect("results", code=code)
    context = {
        "line": progress.of_study(study),
        "tallies": tallies(study),
        "contestants": list(study.contestants.all()),
        "scenario_count": study.scenarios.count(),
        "snapshot": latest_snapshot(study),
        "rules": _shown_rules(study),
        "coverage": coverage(study),
        "reports": list(reports_of(study)),
        "accounts": by_pseudonym(experts()),
        "hypotheses": hypotheses_of(study),
        "frozen": preregistration_sha256(study),
        "stopping": stopping_progress(study),
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
        messages.error(request, translate(error))
    else:
        shares = ", ".join(f"{name} {votes}" for name, votes in taken.items())
        messages.success(request, _("Handed over: %(shares)s.") % {"shares": shares})
    return redirect("study", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def close(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more votes; this can't be taken back, so it asks first."""
    study = get_object_or_404(Study, code=code)
    if not is_sure(request):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        return ask(request, closing(study))
    try:
        close_study(study=study, actor=cast(User, request.user))
    except ArenaError as error:
        messages.error(request, translate(error))
    else:
        messages.success(request, _("Closed. Its results can be read now."))
    return redirect("study", code=code)


def _planned_numbers(request: HttpRequest) -> dict[str, Any]:
    """What the address says of a study that somebody planned, or of one to be like it."""
    initial: dict[str, Any] = {"checks": usual_checks(), "practice": has_practice()}
    initial |= {name: request.GET[name] for name in _PLANNED if request.GET.get(name)}
    code = request.GET.get("study")
    if not code:
        return initial
    try:
        study = get_object_or_404(Study, code=uuid.UUID(code))
    except ValueError:
        raise Http404 from None
    return initial | {
        "contestants": list(study.contestants.values_list("slug", flat=True)),
        "scenarios": list(study.scenarios.values_list("slug", flat=True)),
        "experts": list(study.experts.values_list("username", flat=True)),
    }


def _shown_rules(study: Study) -> dict[str, Any] | None:
    """The rules of the plan for the page, None for votes from a file, which nobody planned."""
    if "entries" not in study.rules:
        return None
    rules = rules_of(study)
    return {
        "by_contestant": bool(rules.appearances),
        "by_pair": bool(rules.pair_votes),
        "repeats": 100 * rules.repeat_share,
        "checks": 100 * rules.check_share if rules.checks else 0,
        "overlap": 100 * rules.overlap_share,
        "adaptive": 100 * rules.adaptive_share,
        "gap": study.rules["scenario_gap_kept"],
        "jobs": study.rules.get("jobs", []),
        "samples": study.rules.get("samples", "one"),
    }
