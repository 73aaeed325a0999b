"""Contestants of a job against each other, over wordings, and in what they refuse."""

from __future__ import annotations

import uuid

from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.exports.formats import format_named
from arena.jobs.exports.tables import ANALYSIS_FORMATS, PARTS, analysis_table
from arena.jobs.queries import analysis_of
from arena.site.access import STAFF, allow_only
from augment.errors import UnknownName
from augment.models import GenerationJob


@allow_only(*STAFF)
@require_safe
def page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """All three parts; a page of its own, because the bootstrap takes a moment the first time."""
    job = get_object_or_404(GenerationJob, code=code)
    context = {"job": job, "analysis": analysis_of(job), "forms": list(ANALYSIS_FORMATS)}
    return render(request, "jobs/analyses.html", context)


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, part: str, form: str) -> HttpResponse:
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
