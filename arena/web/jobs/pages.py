"""Pages of generation jobs."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.exports.formats import format_named
from arena.jobs.exports.tables import CALL_FORMATS as TOOL_CALL_FORMATS
from arena.jobs.pages.displacement import section
from arena.jobs.pages.driving import section as driving_section
from arena.jobs.pages.files import rows_of
from arena.jobs.queries import MARKS, VIEWS, Part, grid_part
from arena.site.access import STAFF, allow_only
from arena.site.listing import (
    choice_asked,
    page_asked,
    read_listing,
    read_page,
    said_choices,
    search_asked,
)
from arena.site.queries import MINE, Narrowing, find_jobs
from augment.errors import UnknownName
from augment.models import Augmentation, GenerationJob
from augment.services.judging.analyses import repeatability
from augment.services.running.budget import costs_of
from augment.services.running.progress import (
    SHOWN,
    count_each,
    count_rows,
    failure_groups,
    pace_of,
    tool_calls_by_augmentation,
    tool_calls_by_contestant,
)
from augment.services.running.workers import workforce

State = Augmentation.State


@allow_only(*STAFF)
@require_safe
def jobs_page(request: HttpRequest) -> HttpResponse:
    """Jobs with their bars, page by page."""
    choices = {
        "state": ("State", said_choices(GenerationJob.State.choices)),
        "by": ("Started by", [(MINE, "me")]),
    }
    listing = read_listing(request, choices)
    wanted = Narrowing(
        search=listing.search, kind=listing.chosen("state"), part=listing.chosen("by")
    )
    found = find_jobs(wanted, user=cast(User, request.user))
    page = read_page(request, found, size=JOBS_AT_ONCE)
    counted = count_each(list(page.object_list))
    context: dict[str, object] = {"jobs": counted, "page": page, "listing": listing}
    if any(counts.is_moving for counts in counted):
        context["workforce"] = workforce()
    return render(request, "jobs/list.html", context)


JOBS_AT_ONCE = 25

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
