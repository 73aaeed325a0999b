"""Pages of studies for admins and analysts: progress, never who leads."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import ArenaError
from arena.models import Study
from arena.queries import progress, scenarios
from arena.queries.people import experts
from arena.queries.results import latest_snapshot
from arena.queries.votes import tallies
from arena.services.studies import close_study, open_study
from arena.web.access import ADMIN, STAFF, only
from arena.web.forms import StudyForm
from augment.errors import AugmentError
from augment.models import Contestant


@only(*STAFF)
@require_safe
def studies_page(request: HttpRequest) -> HttpResponse:
    """Every study with its bar."""
    return render(request, "studies/list.html", {"studies": progress.of_studies()})


@only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_study_page(request: HttpRequest) -> HttpResponse:
    """Who competes on what, and who judges; opening plans every matchup."""
    form = StudyForm(
        request.POST or None,
        contestants=list(Contestant.objects.select_related("endpoint").order_by("name")),
        groups=scenarios.by_type(),
        experts=list(experts().order_by("person__pseudonym")),
    )
    if request.method == "POST" and form.is_valid():
        try:
            study = open_study(**form.rules(), actor=cast(User, request.user))
        except (ArenaError, AugmentError) as error:
            form.add_error(None, str(error))
        else:
            messages.success(request, f"“{study.name}” is open; its experts can vote now.")
            return redirect("study", code=study.code)
    return render(request, "studies/new.html", {"form": form}, status=422 if form.errors else 200)


@only(*STAFF)
@require_safe
def study_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The rules, and how far each expert is."""
    study = get_object_or_404(Study, code=code)
    context = {
        "line": progress.of_study(study),
        "tallies": tallies(study),
        "contestants": list(study.contestants.all()),
        "scenario_count": study.scenarios.count(),
        "snapshot": latest_snapshot(study),
    }
    return render(request, "studies/study.html", context)


@only(ADMIN)
@require_POST
def close(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more votes; this can't be taken back."""
    study = get_object_or_404(Study, code=code)
    try:
        close_study(study=study, actor=cast(User, request.user))
    except ArenaError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "Closed. Its results can be read now.")
    return redirect("study", code=code)
