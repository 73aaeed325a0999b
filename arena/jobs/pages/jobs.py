"""Pages of generation jobs, and what an admin does with one: pause, resume, cancel, try again."""

import uuid

from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse

from arena.jobs.pages.measures import displacement_section, driving_section
from arena.jobs.queries import MARKS, VIEWS, Part, grid_part
from arena.jobs.services import retry_cause as retry_one_cause
from arena.models import ScenarioFile
from arena.site.access import ADMIN, STAFF, act_for, form_for, page_for, user_of
from arena.site.acts import Confirmation, ask, is_sure, refusals_told, send_later
from arena.site.forms import CapsForm
from arena.site.listing import choice_asked, page_asked, read_listing, read_page, search_asked
from augment.models import Augmentation, GenerationJob
from augment.services.inputs import read_request
from augment.services.judging.analyses import repeatability
from augment.services.judging.scenario_export import FORMATS
from augment.services.running import jobs, progress
from augment.services.running.budget import Caps, count_unpriced
from augment.services.running.workers import workforce
from augment.tasks import enqueue_job

State = Augmentation.State
JOBS_AT_ONCE = 25
MEASURED_AT_ONCE = 1000
"""Of a job with more augmentations the page measures nothing until somebody asks for it."""

_ASK_TO_MEASURE = frozenset({"measures", "by", "checks"})


@page_for(*STAFF)
def jobs_page(request: HttpRequest) -> HttpResponse:
    """List jobs with their bars, page by page."""
    choices = {
        "state": ("State", GenerationJob.State.choices),
        "by": ("Started by", [("mine", "me")]),
    }
    listing = read_listing(request, choices)
    rows = GenerationJob.objects.select_related("launched_by__person")
    rows = listing.narrow(rows, "name", by=["state"]).order_by("-created_at", "-pk")
    if listing.chosen("by"):
        rows = rows.filter(launched_by=user_of(request))
    page = read_page(request, rows, size=JOBS_AT_ONCE)
    counted = progress.count_each(list(page.object_list))
    context: dict[str, object] = {"jobs": counted, "page": page, "listing": listing}
    if any(counts.is_moving for counts in counted):
        context["workforce"] = workforce()
    return render(request, "jobs/list.html", context)


@page_for(*STAFF)
def job_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show progress, a part of the grid, and failures by their cause."""
    job = get_object_or_404(GenerationJob.objects.select_related("launched_by__person"), code=code)
    counts = progress.count_rows(job)
    part = Part(
        view=VIEWS.get(request.GET.get("view", ""), MARKS),
        row=page_asked(request, "row"),
        column=page_asked(request, "column"),
        sample=page_asked(request, "sample"),
        state=choice_asked(request, "state", State.values),
        search=search_asked(request),
    )
    context: dict[str, object] = {
        "counts": counts,
        "unpriced": count_unpriced(job),
        "grid": grid_part(job, part),
        "failures": progress.failure_groups(job),
        "shown_causes": progress.SHOWN,
    }
    if counts.is_moving:  # a page that reloads every two seconds measures nothing
        context["workforce"] = workforce()
    elif counts.total <= MEASURED_AT_ONCE or _ASK_TO_MEASURE & request.GET.keys():
        context |= _measure(request, job)
    else:
        context["could_measure"] = True
    return render(request, "jobs/job.html", context)


def _measure(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """Return the context of all that a settled job is measured by."""
    files = {row.format: row for row in ScenarioFile.objects.filter(job=job).order_by("pk")}
    measured: dict[str, object] = {
        "scenario_files": [(form, files.get(form)) for form in FORMATS],
        "displacement": displacement_section(request, job),
        "driving": driving_section(request, job),
        "has_tool_calls": bool(progress.tool_calls(job)),
    }
    if job.samples > 1:
        measured["repeats"] = repeatability(job)
    return measured


@act_for(ADMIN, back="job")
def retry_job(request: HttpRequest, code: uuid.UUID) -> None:
    """Queue again what failed."""
    job = get_object_or_404(GenerationJob, code=code)
    with transaction.atomic():
        jobs.retry_failed(job=job, actor=user_of(request))
        send_later(request, enqueue_job, job.pk)
        messages.success(request, "What failed is queued again.")


@act_for(ADMIN, back="job")
def retry_cause(request: HttpRequest, code: uuid.UUID, key: str) -> None:
    """Queue again what ended for one cause; of an unreadable answer the last attempt counts."""
    job = get_object_or_404(GenerationJob, code=code)
    with transaction.atomic():
        retry_one_cause(job, key=key, actor=user_of(request))
        send_later(request, enqueue_job, job.pk)
        messages.success(request, "What ended for this cause is queued again.")


@act_for(ADMIN, back="job")
def pause_job(request: HttpRequest, code: uuid.UUID) -> None:
    """Start nothing new; what is in flight ends."""
    job = get_object_or_404(GenerationJob, code=code)
    jobs.pause(job, actor=user_of(request))
    messages.success(request, "Paused: nothing new is started; what is in flight ends.")


@act_for(ADMIN, back="job")
def resume_job(request: HttpRequest, code: uuid.UUID) -> None:
    """Raise the caps that are given, then go on with what is left."""
    job = get_object_or_404(GenerationJob, code=code)
    form = CapsForm(request.POST)
    if not form.is_valid():
        messages.error(request, "A cap is a number; nothing was changed.")
        return
    with transaction.atomic():
        jobs.resume(job, higher=read_request(Caps, form.cleaned_data), actor=user_of(request))
        send_later(request, enqueue_job, job.pk)
        messages.success(request, "What is left is queued again.")


@form_for(ADMIN)
def cancel_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Start nothing new; what is done stays. There is no way back, so ask first."""
    job = get_object_or_404(GenerationJob, code=code)
    if is_sure(request):
        with refusals_told(request):
            jobs.cancel(job=job, actor=user_of(request))
            messages.success(request, "Cancelled. What is done stays.")
    elif job.state in jobs.OPEN:
        return ask(request, _cancelling(job))
    return redirect("job", code=code)


def _cancelling(job: GenerationJob) -> Confirmation:
    counts = progress.count_rows(job)
    return Confirmation(
        title=f"Cancel “{job.name}”?",
        facts=(
            f"Augmentations that wait and are never made: {counts.by_state[State.QUEUED]}.",
            f"Settled, which stay as they are: {counts.settled}. What runs ends and is kept.",
            "A cancelled job can’t go on; what is missing takes a new one.",
        ),
        button="Cancel the job",
        back=reverse("job", args=[job.code]),
        crumbs=crumbs_of(job),
    )


def crumbs_of(job: GenerationJob) -> tuple[tuple[str, str], ...]:
    """Return the way to a job's page: names and addresses."""
    return (("Jobs", reverse("jobs")), (job.name, reverse("job", args=[job.code])))
