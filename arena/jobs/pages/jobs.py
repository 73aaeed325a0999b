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
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.exports.formats import format_named
from arena.jobs.exports.tables import CALL_FORMATS as TOOL_CALL_FORMATS
from arena.jobs.pages.displacement import section
from arena.jobs.pages.driving import section as driving_section
from arena.jobs.pages.files import rows_of
from arena.jobs.queries import MARKS, VIEWS, Part, grid_part
from arena.queries.listings import MINE, Narrowing, find_jobs
from arena.services.retrying import retry_cause as retry_one_cause
from arena.web.access import ADMIN, STAFF, allow_only
from arena.web.forms import CapsForm
from arena.web.listing import (
    choice_asked,
    page_asked,
    read_listing,
    read_page,
    said_choices,
    search_asked,
)
from arena.web.questions import Confirmation, ask, is_sure
from augment.errors import AugmentError, QueueFault, UnknownName
from augment.models import Augmentation, GenerationJob
from augment.services.judging.analyses import repeatability
from augment.services.running import jobs
from augment.services.running import jobs as service
from augment.services.running.budget import costs_of
from augment.services.running.progress import (
    SHOWN,
    count_each,
    count_rows,
    failure_groups,
    pace_of,
    rows_of_cause,
    tool_calls_by_augmentation,
    tool_calls_by_contestant,
)
from augment.services.running.workers import workforce
from augment.tasks import enqueue_job

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


@allow_only(ADMIN)
@require_POST
def retry_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Queue again what failed."""
    job = get_object_or_404(GenerationJob, code=code)
    try:
        with transaction.atomic():
            jobs.retry_failed(job=job, actor=cast(User, request.user))
            transaction.on_commit(partial(send_rows, request, job.pk))
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "What failed is queued again.")
    return redirect("job", code=code)


@allow_only(ADMIN)
@require_POST
def retry_cause(request: HttpRequest, code: uuid.UUID, key: str) -> HttpResponse:
    """Queue again what ended for one cause; a second chance for an answer is asked about first."""
    job = get_object_or_404(GenerationJob, code=code)
    try:
        state, _cause, pks = rows_of_cause(job, key)
        if state == State.UNREADABLE and not is_sure(request):
            return ask(request, _second_chance(job, len(pks)))
        with transaction.atomic():
            retry_one_cause(job, key=key, actor=cast(User, request.user))
            transaction.on_commit(partial(send_rows, request, job.pk))
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, f"Queued again: {len(pks)} with this cause.")
    return redirect("job", code=code)


@allow_only(ADMIN)
@require_POST
def pause_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Start nothing new; what is in flight ends."""
    job = get_object_or_404(GenerationJob, code=code)
    try:
        jobs.pause(job, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "Paused: nothing new is started; what is in flight ends.")
    return redirect("job", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def cancel_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Start nothing new; what is done stays. There is no way back, so it asks first."""
    job = get_object_or_404(GenerationJob, code=code)
    if not is_sure(request):
        if job.state not in service.OPEN:
            return redirect("job", code=code)
        return ask(request, _cancelling(job))
    try:
        service.cancel(job=job, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "Cancelled. What is done stays.")
    return redirect("job", code=code)


@allow_only(ADMIN)
@require_POST
def resume_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Raise the caps that are given, then go on with what is left."""
    job = get_object_or_404(GenerationJob, code=code)
    form = CapsForm(request.POST)
    if not form.is_valid():
        messages.error(request, "A cap is a number; nothing was changed.")
        return redirect("job", code=code)
    try:
        with transaction.atomic():
            jobs.resume(job, higher=form.caps(), actor=cast(User, request.user))
            transaction.on_commit(partial(send_rows, request, job.pk))
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "What is left is queued again.")
    return redirect("job", code=code)


def send_rows(request: HttpRequest, job_pk: int) -> None:
    """Put the job's rows on the queue; without a queue they wait, and the person is told."""
    try:
        enqueue_job(job_pk)
    except QueueFault as error:
        messages.warning(request, str(error))


# --- Private -----------------------------------------------------------------------------------


def _cancelling(job: GenerationJob) -> Confirmation:
    """What is asked before a job is cancelled."""
    found = count_rows(job).by_state
    waiting, running = found[State.QUEUED], found[State.RUNNING]
    settled = sum(found.values()) - waiting - running
    facts = (
        f"Augmentations that wait and are never made: {waiting}.",
        f"Running now, which end and keep their results: {running}.",
        f"Settled, which stay as they are: {settled}.",
        "A cancelled job can’t go on; what is missing takes a new one.",
    )
    return Confirmation(
        title=f"Cancel “{job.name}”?",
        facts=facts,
        button="Cancel the job",
        back=reverse("job", args=[job.code]),
        crumbs=_crumbs(job),
    )


def _second_chance(job: GenerationJob, number: int) -> Confirmation:
    """What is asked before answers are asked for a second time."""
    return Confirmation(
        title=f"Ask again for {number} unreadable answers?",
        facts=(
            "An unreadable answer is the contestant’s own and counts as a miss.",
            "Asked again it has a second chance that the others did not have; that is logged.",
            "The attempts so far stay in the transcripts; what counts is the last one.",
        ),
        button="Ask again",
        back=reverse("job", args=[job.code]),
        is_final=False,
        crumbs=_crumbs(job),
    )


def _crumbs(job: GenerationJob) -> tuple[tuple[str, str], ...]:
    return (("Jobs", reverse("jobs")), (job.name, reverse("job", args=[job.code])))
