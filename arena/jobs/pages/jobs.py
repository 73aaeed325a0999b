"""Pages of generation jobs, and what an admin does with one: pause, resume, cancel, try again."""

import uuid
from collections.abc import Callable

from django.contrib import messages
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse

from arena.jobs.exports.realism import realism_context
from arena.jobs.pages.measures import ask_to_measure, displacement_section, driving_section
from arena.jobs.queries import grid_part
from arena.models import ScenarioFile
from arena.shell.access import ADMIN, STAFF, act_for, form_for, get_user, page_for
from arena.shell.acts import Confirmation, ask, is_sure, refusals_told, send_later
from arena.shell.forms import CapsForm
from arena.shell.listing import page_asked, read_listing, read_page
from augment.models import Augmentation, GenerationJob
from augment.services import read_request
from augment.services.judging import repeatability
from augment.services.judging.scenario_export import FORMATS
from augment.services.running import Caps, JobCounts, count_unpriced, jobs, progress, workforce

State = Augmentation.State
JOBS_AT_ONCE = 25

Context = dict[str, object]


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
    if listing.find_choice("by"):
        rows = rows.filter(launched_by=get_user(request))
    page = read_page(request, rows, size=JOBS_AT_ONCE)
    counted = progress.count_each(list(page.object_list))
    context: Context = {"jobs": counted, "page": page, "listing": listing}
    if any(counts.is_moving for counts in counted):
        context["workforce"] = workforce()
    return render(request, "jobs/list.html", context)


@page_for(*STAFF)
def job_page(request: HttpRequest, code: uuid.UUID, tab: str = "") -> HttpResponse:
    """Show one part of a job; without a name the one that answers first."""
    job = get_object_or_404(GenerationJob.objects.select_related("launched_by__person"), code=code)
    counts = progress.count_rows(job)
    tabs = _list_tabs(counts)
    shown = tab or _first_tab(counts, tabs)
    if shown not in TABS:
        raise Http404
    if shown not in tabs:
        return redirect("job", code=code)
    context = {
        **{"counts": counts, "tab": shown, "tab_template": f"jobs/tabs/{shown}.html"},
        "is_live": not counts.is_over,
        "tabs": {name: TABS[name][0] for name in tabs},
    }
    if shown in MEASURED_TABS and (unmeasured := ask_to_measure(request, job)):
        template = "jobs/tabs/unmeasured.html"
        context |= {"is_live": True, "unmeasured": unmeasured, "tab_template": template}
    else:
        context |= TABS[shown][1](request, counts)
    if context["is_live"]:
        context["workforce"] = workforce()
    return render(request, "jobs/job.html", context)


def _list_tabs(counts: JobCounts) -> list[str]:
    """Return the names of the parts that have something to show."""
    job, left_out = counts.job, set()
    if not any(counts.by_state[state] for state in progress.GROUPED):
        left_out.add("failures")
    if not (job.spent_calls or job.reserved_calls or job.is_capped):
        left_out.add("money")
    if counts.is_moving or not counts.settled:  # a page that reloads itself measures nothing
        left_out |= {"displacement", "realism", "driving", "files"}
    return [name for name in TABS if name not in left_out]


def _first_tab(counts: JobCounts, tabs: list[str]) -> str:
    if counts.job.state == GenerationJob.State.STOPPED_AT_CAP:
        return "money"
    if not counts.is_over:
        return "progress"
    return "failures" if "failures" in tabs and not counts.by_state[State.DONE] else "grid"


def _show_grid(request: HttpRequest, counts: JobCounts) -> Context:
    states = [
        (state, f"{state.label} ({number})")
        for state, number in counts.by_state.items()
        if number or state == request.GET.get("state")
    ]
    listing = read_listing(request, {"state": ("With a result that is", states)})
    grid = grid_part(counts.job, listing, page_asked(request, "row"))
    return {"grid": grid, "listing": listing}


def _show_failures(_request: HttpRequest, counts: JobCounts) -> Context:
    return {"failures": progress.failure_groups(counts.job), "shown_causes": progress.SHOWN}


def _show_displacement(request: HttpRequest, counts: JobCounts) -> Context:
    repeats = repeatability(counts.job) if counts.job.samples > 1 else None
    return {"displacement": displacement_section(request, counts.job), "repeats": repeats}


def _show_files(_request: HttpRequest, counts: JobCounts) -> Context:
    files = {row.format: row for row in ScenarioFile.objects.filter(job=counts.job).order_by("pk")}
    return {
        "is_live": not counts.is_over or any(row.is_waiting for row in files.values()),
        "scenario_files": [(form, files.get(form)) for form in FORMATS],
        "has_tool_calls": bool(progress.tool_calls(counts.job)),
    }


TABS: dict[str, tuple[str, Callable[[HttpRequest, JobCounts], Context]]] = {
    "grid": ("Results", _show_grid),
    "progress": ("Progress", lambda _request, _counts: {}),
    "failures": ("Failures", _show_failures),
    "money": ("Money", lambda _request, counts: {"unpriced": count_unpriced(counts.job)}),
    "displacement": ("Displacement", _show_displacement),
    "realism": ("Realism", lambda _asked, of: {"realism": realism_context(of.job)}),
    "driving": ("Driving", lambda request, of: {"driving": driving_section(request, of.job)}),
    "files": ("Files", _show_files),
}
"""The parts of a job's page: what they are called, and what their templates show."""
MEASURED_TABS = ("displacement", "realism")


@act_for(ADMIN, back="job")
def retry_job(request: HttpRequest, code: uuid.UUID) -> None:
    """Queue again what failed."""
    job = get_object_or_404(GenerationJob, code=code)
    with transaction.atomic():
        jobs.retry_failed(job=job, actor=get_user(request))
        send_later(request, job)
        messages.success(request, "What failed is queued again.")


@act_for(ADMIN, back="job")
def pause_job(request: HttpRequest, code: uuid.UUID) -> None:
    """Start nothing new; what is in flight ends."""
    job = get_object_or_404(GenerationJob, code=code)
    jobs.pause(job, actor=get_user(request))
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
        jobs.resume(job, higher=read_request(Caps, form.cleaned_data), actor=get_user(request))
        send_later(request, job)
        messages.success(request, "What is left is queued again.")


@form_for(ADMIN)
def cancel_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Start nothing new; what is done stays. There is no way back, so ask first."""
    job = get_object_or_404(GenerationJob, code=code)
    if is_sure(request):
        with refusals_told(request):
            jobs.cancel(job=job, actor=get_user(request))
            messages.success(request, "Cancelled. What is done stays.")
    elif job.state in jobs.OPEN:
        counts = progress.count_rows(job)
        question = Confirmation(
            title=f"Cancel “{job.name}”?",
            facts=(
                f"Augmentations that wait and are never made: {counts.by_state[State.QUEUED]}.",
                f"Settled, which stay as they are: {counts.settled}. What runs ends and is kept.",
                "A cancelled job can’t go on; what is missing takes a new one.",
            ),
            button="Cancel the job",
            back=reverse("job", args=[job.code]),
            crumbs=job_crumbs(job),
        )
        return ask(request, question)
    return redirect("job", code=code)


def job_crumbs(job: GenerationJob) -> tuple[tuple[str, str], ...]:
    """Return the way to a job's page: names and addresses."""
    return (("Jobs", reverse("jobs")), (job.name, reverse("job", args=[job.code])))
