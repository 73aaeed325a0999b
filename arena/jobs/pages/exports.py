"""Files of a job: its tables, transcripts, and scenarios in standard formats."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.files.storage import default_storage
from django.db import transaction
from django.http import (
    FileResponse,
    Http404,
    HttpRequest,
    HttpResponse,
    HttpResponseBase,
    StreamingHttpResponse,
)
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_POST, require_safe

from arena import tasks
from arena.exports.files import CONTENT_TYPE
from arena.exports.formats import download
from arena.jobs.exports import displacement_files, driving
from arena.jobs.exports.displacement import DisplacementTable, displacement_table
from arena.jobs.exports.files import TRANSCRIPT_FORMATS, transcript_lines
from arena.jobs.exports.registry import JOB_TABLES
from arena.jobs.exports.tables import TABLE_FORMATS
from arena.jobs.pages.driving import driving_asked, score_asked
from arena.jobs.queries import analysis_of
from arena.jobs.services import ask_for_file
from arena.models import ScenarioFile
from arena.site.access import STAFF, allow_only
from arena.site.acts import send_later
from augment.errors import AugmentError
from augment.models import GenerationJob
from augment.services.judging.displacement import By, types_named
from augment.services.judging.scenario_export import FORMATS

BY_OBJECT = "object"
"""How the table with one row an object is asked for, beside the groupings."""

LABELS = {By.CONTESTANT: "Contestant", By.TYPE: "Scenario type", By.VARIANT: "Variant"}


@allow_only(*STAFF)
@require_safe
def export_table(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
    """Answer with a table as a file, with the options that its part of the page has."""
    job = get_object_or_404(GenerationJob, code=code)
    stem = slugify(job.name) or "job"
    if name == "displacement" and request.GET.get("by") == BY_OBJECT:
        name = "displacement-objects"
    if name == "displacement":
        table = displacement_asked(request, job)
        stem += f"-displacement-by-{table.by}" + "-all-types" * _asks_for_all_types(request)
        return download(displacement_files.FORMATS, form, stem, lambda: table)
    if name == "driving":
        stem += f"-driving-{score_asked(request)}"
        return download(driving.FORMATS, form, stem, lambda: driving_asked(request, job))
    if name not in JOB_TABLES:
        raise Http404
    known = JOB_TABLES[name]
    return download(known.formats, form, f"{stem}-{name}", lambda: known.make(job))


@allow_only(*STAFF)
@require_safe
def export_analysis(
    request: HttpRequest, code: uuid.UUID, part: str, form: str
) -> HttpResponseBase:
    """Answer with one part of the analyses as a file."""
    return export_table(request, code=code, name=f"analyses-{part}", form=form)


@allow_only(*STAFF)
@require_safe
def export_transcripts(request: HttpRequest, code: uuid.UUID) -> StreamingHttpResponse:
    """Answer with a line of JSON for each augmentation, sent while the rest is read."""
    job = get_object_or_404(GenerationJob, code=code)
    name = f"{slugify(job.name) or 'job'}-transcripts.jsonl"
    return StreamingHttpResponse(
        transcript_lines(job),
        content_type=TRANSCRIPT_FORMATS["jsonl"].content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@allow_only(*STAFF)
@require_safe
def analyses_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show all three parts, on a page of their own: the bootstrap may take seconds."""
    job = get_object_or_404(GenerationJob, code=code)
    context = {"job": job, "analysis": analysis_of(job), "forms": list(TABLE_FORMATS)}
    return render(request, "jobs/analyses.html", context)


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
    """Answer with a zip that is ready."""
    row = get_object_or_404(ScenarioFile, code=code, state=ScenarioFile.State.READY)
    try:
        content = default_storage.open(row.stored)
    except FileNotFoundError:
        raise Http404 from None
    return FileResponse(content, as_attachment=True, filename=row.name, content_type=CONTENT_TYPE)


def displacement_asked(request: HttpRequest, job: GenerationJob) -> DisplacementTable:
    """Return the displacement table that an address asks for: by contestant, unless it says so."""
    by = request.GET.get("by", By.CONTESTANT)
    return displacement_table(
        job,
        by=By(by) if by in set(By) else By.CONTESTANT,
        types=types_named(["all"]) if _asks_for_all_types(request) else None,
    )


def displacement_section(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """Return the context of the displacement part of a job's page."""
    table, is_all = displacement_asked(request, job), _asks_for_all_types(request)
    return {
        "table": table,
        "by": table.by,
        "labels": LABELS,
        "forms": displacement_files.FORMATS,
        "object_forms": TABLE_FORMATS,
        "query": f"by={table.by}" + "&types=all" * is_all,
        "has_choice": table.by is By.VARIANT,
        "is_all": is_all,
    }


def _asks_for_all_types(request: HttpRequest) -> bool:
    return request.GET.get("types") == "all"
