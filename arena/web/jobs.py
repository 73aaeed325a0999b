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
from django.utils.translation import gettext as _
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.exports.formats import format_named
from arena.exports.tool_calls import FORMATS as TOOL_CALL_FORMATS
from arena.queries import jobs, scenarios
from arena.web.access import ADMIN, STAFF, allow_only
from arena.web.displacement import section
from arena.web.driving import section as driving_section
from arena.web.forms import CapsForm, LaunchForm
from arena.web.questions import Confirmation, ask, is_sure
from arena.web.scenario_files import rows_of
from augment.errors import AugmentError, QueueFault, UnknownName
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints import contestants
from augment.services.judging.repeatability import repeatability
from augment.services.running import caps
from augment.services.running import jobs as service
from augment.services.running.caps import Caps
from augment.services.running.costs import costs_of
from augment.services.running.matrix import matrix_text
from augment.services.running.summary import count_rows, failure_groups, list_jobs
from augment.services.running.tool_calls import (
    tool_calls_by_augmentation,
    tool_calls_by_contestant,
)
from augment.services.running.workers import workforce
from augment.services.wording import translate
from augment.tasks import enqueue_job

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


@allow_only(*STAFF)
@require_safe
def job_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Progress, the grid, and failures by their reason."""
    job = get_object_or_404(GenerationJob.objects.select_related("launched_by__person"), code=code)
    found = count_rows(job)
    context: dict[str, object] = {
        "counts": found,
        "costs": costs_of(job),
        "grid": jobs.grid(job),
        "failures": failure_groups(job),
    }
    if found.is_moving:
        context["workforce"] = workforce()
    else:  # a page that shows itself anew every two seconds measures nothing
        context["scenario_files"] = rows_of(job)
        context["displacement"] = section(request, job)
        if job.samples > 1:
            is_checked = request.GET.get("checks") == "1"
            context["repeats"] = repeatability(job, with_checks=is_checked)
            context["is_checked"] = is_checked
        context["driving"] = driving_section(request, job)
        context["tool_calls"] = tool_calls_by_contestant(job)
    return render(request, "jobs/job.html", context)


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
            service.retry_failed(job=job, actor=cast(User, request.user))
            transaction.on_commit(partial(_send, request, job.pk))
    except AugmentError as error:
        messages.error(request, translate(error))
    else:
        messages.success(request, _("What failed is queued again."))
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
        messages.error(request, translate(error))
    else:
        messages.success(request, _("Cancelled. What is done stays."))
    return redirect("job", code=code)


@allow_only(ADMIN)
@require_POST
def resume_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Raise the caps that are given, then go on with what is left."""
    job = get_object_or_404(GenerationJob, code=code)
    form = CapsForm(request.POST)
    if not form.is_valid():
        messages.error(request, _("A cap is a number; nothing was changed."))
        return redirect("job", code=code)
    try:
        with transaction.atomic():
            actor = cast(User, request.user)
            if form.caps() != Caps():
                job = caps.raise_cap(job, caps=form.caps(), actor=actor)
            caps.resume(job, actor=actor)
            transaction.on_commit(partial(_send, request, job.pk))
    except AugmentError as error:
        messages.error(request, translate(error))
    else:
        messages.success(request, _("What is left is queued again."))
    return redirect("job", code=code)


def _cancelling(job: GenerationJob) -> Confirmation:
    """What is asked before a job is cancelled."""
    found = count_rows(job).by_state
    waiting, running = found[State.QUEUED], found[State.RUNNING]
    settled = sum(found.values()) - waiting - running
    facts = (
        _("Augmentations that wait and are never made: %(n)s.") % {"n": waiting},
        _("Running now, which end and keep their results: %(n)s.") % {"n": running},
        _("Settled, which stay as they are: %(n)s.") % {"n": settled},
        _("A cancelled job can’t go on; what is missing takes a new one."),
    )
    return Confirmation(
        title=_("Cancel “%(name)s”?") % {"name": job.name},
        facts=facts,
        button=_("Cancel the job"),
        back=reverse("job", args=[job.code]),
        crumbs=((_("Jobs"), reverse("jobs")), (job.name, reverse("job", args=[job.code]))),
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
        transaction.on_commit(partial(_send, request, job.pk))
    return job


def _send(request: HttpRequest, job_pk: int) -> None:
    """Put the job's rows on the queue; without a queue they wait, and the person is told."""
    try:
        enqueue_job(job_pk)
    except QueueFault as error:
        messages.warning(request, translate(error))
