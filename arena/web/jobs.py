"""Pages of generation jobs."""

from __future__ import annotations

import uuid
from functools import partial
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.utils.translation import gettext as _
from django.views.decorators.http import require_http_methods, require_safe

from arena.exports.formats import format_named
from arena.exports.tool_calls import FORMATS as TOOL_CALL_FORMATS
from arena.queries import scenarios
from arena.queries.job_grid import MARKS, VIEWS, Part, grid_part
from arena.web.access import ADMIN, STAFF, allow_only
from arena.web.displacement import section
from arena.web.driving import section as driving_section
from arena.web.forms import LaunchForm
from arena.web.job_actions import send_rows
from arena.web.listing import choice_asked, page_asked, search_asked
from arena.web.scenario_files import rows_of
from augment.errors import AugmentError, UnknownName
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints import contestants
from augment.services.judging.repeatability import repeatability
from augment.services.running import jobs as service
from augment.services.running.causes import SHOWN, failure_groups
from augment.services.running.costs import costs_of
from augment.services.running.matrix import matrix_text
from augment.services.running.pace import pace_of
from augment.services.running.summary import count_rows, list_jobs
from augment.services.running.tool_calls import (
    tool_calls_by_augmentation,
    tool_calls_by_contestant,
)
from augment.services.running.workers import workforce
from augment.services.wording import translate

State = Augmentation.State


@allow_only(*STAFF)
@require_safe
def jobs_page(request: HttpRequest) -> HttpResponse:
    """Every job with its bar."""
    found = list_jobs()
    context: dict[str, object] = {"jobs": found}
    if any(counts.is_moving for counts in found):
        context["workforce"] = workforce()
    return render(request, "jobs/list.html", context)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_job_page(request: HttpRequest) -> HttpResponse:
    """Choose contestants and scenarios, then launch."""
    contestants.ensure_builtin()
    chosen_set = scenarios.set_asked(request.GET.get("set"))
    form = LaunchForm(
        request.POST or None,
        contestants=list(
            Contestant.objects.filter(retired_at=None).select_related("endpoint").order_by("name")
        ),
        groups=scenarios.by_type(chosen_set),
    )
    if "matrix" in request.POST:
        return _matrix(request, form)
    if "estimate" in request.POST:
        return _estimated(request, form, chosen_set)
    if request.method == "POST" and form.is_valid():
        try:
            job = _launch(request, form)
        except AugmentError as error:
            form.add_error(None, translate(error))
        else:
            messages.success(request, _("“%(name)s” is launched.") % {"name": job.name})
            return redirect("job", code=job.code)
    context = {"form": form, "sets": scenarios.set_choices(chosen_set)}
    return render(request, "jobs/new.html", context, status=422 if form.errors else 200)


MEASURED_AT_ONCE = 1000
"""Of a job with more augmentations the page measures nothing until somebody asks for it."""

_ASK_TO_MEASURE = frozenset({"measures", "by", "types", "checks"})


@allow_only(*STAFF)
@require_safe
def job_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Progress, a part of the grid, and failures by their cause."""
    job = get_object_or_404(GenerationJob.objects.select_related("launched_by__person"), code=code)
    found = count_rows(job)
    context: dict[str, object] = {
        "counts": found,
        "costs": costs_of(job),
        "grid": grid_part(job, _part_asked(request)),
        "failures": failure_groups(job),
        "shown_causes": SHOWN,
    }
    if found.is_moving:  # a page that shows itself anew every two seconds measures nothing
        context |= {"workforce": workforce(), "pace": pace_of(found)}
    elif found.total <= MEASURED_AT_ONCE or _ASK_TO_MEASURE & request.GET.keys():
        context |= _measured(request, job)
    else:
        context["could_measure"] = True
    return render(request, "jobs/job.html", context)


def _measured(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """What a job that does not move is measured by."""
    measured: dict[str, object] = {
        "scenario_files": rows_of(job),
        "displacement": section(request, job),
        "driving": driving_section(request, job),
        "tool_calls": tool_calls_by_contestant(job),
    }
    if job.samples > 1:
        is_checked = request.GET.get("checks") == "1"
        measured["repeats"] = repeatability(job, with_checks=is_checked)
        measured["is_checked"] = is_checked
    return measured


def _part_asked(request: HttpRequest) -> Part:
    """Which part of the grid the address asks for; what it can't mean counts as not said."""
    return Part(
        view=VIEWS.get(request.GET.get("view", ""), MARKS),
        row=page_asked(request, "row"),
        column=page_asked(request, "column"),
        sample=page_asked(request, "sample"),
        state=choice_asked(request, "state", State.values),
        search=search_asked(request),
    )


@allow_only(*STAFF)
@require_safe
def export_tool_calls(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """How each augmentation's contestant called its function, as a file."""
    job = get_object_or_404(GenerationJob, code=code)
    try:
        chosen = format_named(TOOL_CALL_FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    name = f"{slugify(job.name) or 'job'}-tool-calls.{chosen.suffix}"
    return HttpResponse(
        chosen.write(tool_calls_by_augmentation(job)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


def _estimated(request: HttpRequest, form: LaunchForm, chosen_set: str) -> HttpResponse:
    """The page as it came in, with what the job would use; nothing is launched."""
    context: dict[str, object] = {"form": form, "sets": scenarios.set_choices(chosen_set)}
    try:
        found = form.estimated()
    except AugmentError as error:
        form.add_error(None, translate(error))
    else:
        cap = form.cleaned_data.get("cap_usd")
        context |= {"estimate": found, "cap_usd": cap}
        if found is not None and cap is not None:
            context["rows_within"] = found.rows_within(cap)
    return render(request, "jobs/new.html", context)


def _matrix(request: HttpRequest, form: LaunchForm) -> HttpResponse:
    """What is chosen as a file for `generate --matrix`; a name is not needed for it."""
    form.is_valid()
    form.errors.pop("name", None)
    if form.errors:
        return render(request, "jobs/new.html", {"form": form}, status=422)
    chosen = form.cleaned_data
    text = matrix_text(
        chosen["contestants"],
        chosen["scenarios"],
        samples=chosen["samples"],
        name=chosen.get("name", ""),
    )
    return HttpResponse(
        text,
        content_type="application/yaml; charset=utf-8",
        headers={"Content-Disposition": 'attachment; filename="matrix.yaml"'},
    )


def _launch(request: HttpRequest, form: LaunchForm) -> GenerationJob:
    with transaction.atomic():
        job = service.launch(
            name=form.cleaned_data["name"],
            contestants=form.cleaned_data["contestants"],
            scenarios=form.cleaned_data["scenarios"],
            caps=form.caps(),
            samples=form.cleaned_data["samples"],
            is_fresh=form.cleaned_data["is_fresh"],
            actor=cast(User, request.user),
        )
        transaction.on_commit(partial(send_rows, request, job.pk))
    return job
