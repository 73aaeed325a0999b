"""What a job made, as scenarios in a standard format: one zip a format, written by a worker."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.files.storage import default_storage
from django.db import transaction
from django.http import FileResponse, Http404, HttpRequest, HttpResponse, StreamingHttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_POST, require_safe

from arena import tasks
from arena.exports.formats import format_named
from arena.exports.zips import CONTENT_TYPE
from arena.jobs.exports.files import TRANSCRIPT_FORMATS, transcript_lines
from arena.jobs.exports.tables import ANALYSIS_FORMATS, PARTS, analysis_table
from arena.jobs.queries import analysis_of
from arena.jobs.services import ask_for_file, files_of
from arena.models import ScenarioFile
from arena.web.access import STAFF, allow_only
from arena.web.sending import send_later
from augment.errors import AugmentError, UnknownName
from augment.models import GenerationJob
from augment.services.judging.scenario_export import FORMATS


def rows_of(job: GenerationJob) -> list[tuple[str, ScenarioFile | None]]:
    """Each format with its newest zip, for a job's page."""
    found = files_of(job)
    return [(form, found.get(form)) for form in FORMATS]


@allow_only(*STAFF)
@require_POST
def ask_for_scenarios(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """Leave a zip of all scenarios of a job to a worker; twice does no harm."""
    job = get_object_or_404(GenerationJob, code=code)
    if form not in FORMATS:
        raise Http404
    try:
        with transaction.atomic():
            row = ask_for_file(job=job, file_format=form, actor=cast(User, request.user))
            send_later(request, tasks.send_scenario_file, row.pk)
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "A worker writes the file; it is offered here when ready.")
    return redirect(reverse("job", args=[code]) + "#scenario-files")


@allow_only(*STAFF)
@require_safe
def download_scenarios(request: HttpRequest, code: uuid.UUID) -> FileResponse:
    """A zip that is ready."""
    row = get_object_or_404(ScenarioFile, code=code, state=ScenarioFile.State.READY)
    try:
        content = default_storage.open(row.stored)
    except FileNotFoundError:
        raise Http404 from None
    return FileResponse(content, as_attachment=True, filename=row.name, content_type=CONTENT_TYPE)


@allow_only(*STAFF)
@require_safe
def export_transcripts(request: HttpRequest, code: uuid.UUID) -> StreamingHttpResponse:
    """A line of JSON for each augmentation, sent while the rest is read."""
    job = get_object_or_404(GenerationJob, code=code)
    form = TRANSCRIPT_FORMATS["jsonl"]
    name = f"{slugify(job.name) or 'job'}-transcripts.{form.suffix}"
    return StreamingHttpResponse(
        transcript_lines(job),
        content_type=form.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@allow_only(*STAFF)
@require_safe
def analyses_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """All three parts; a page of its own, because the bootstrap takes a moment the first time."""
    job = get_object_or_404(GenerationJob, code=code)
    context = {"job": job, "analysis": analysis_of(job), "forms": list(ANALYSIS_FORMATS)}
    return render(request, "jobs/analyses.html", context)


@allow_only(*STAFF)
@require_safe
def export_analysis(request: HttpRequest, code: uuid.UUID, part: str, form: str) -> HttpResponse:
    """One part as a file."""
    job = get_object_or_404(GenerationJob, code=code)
    if part not in PARTS:
        raise Http404
    try:
        chosen = format_named(ANALYSIS_FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    name = f"{slugify(job.name) or 'job'}-{part}.{chosen.suffix}"
    return HttpResponse(
        chosen.write(analysis_table(analysis_of(job), part)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
