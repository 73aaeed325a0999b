"""What an admin does with a job that there is: pause, resume, cancel, try again."""

from __future__ import annotations

import uuid
from functools import partial
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect
from django.urls import reverse
from django.views.decorators.http import require_http_methods, require_POST

from arena.services.retrying import retry_cause as retry_one_cause
from arena.site.access import ADMIN, allow_only
from arena.site.acts import Confirmation, ask, is_sure
from arena.site.forms import CapsForm
from augment.errors import AugmentError, QueueFault
from augment.models import Augmentation, GenerationJob
from augment.services.running import jobs
from augment.services.running import jobs as service
from augment.services.running.progress import count_rows, rows_of_cause
from augment.tasks import enqueue_job

State = Augmentation.State


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
