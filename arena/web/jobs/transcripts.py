"""All transcripts of a job as one file."""

from __future__ import annotations

import uuid

from django.http import HttpRequest, StreamingHttpResponse
from django.shortcuts import get_object_or_404
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.jobs.exports.files import TRANSCRIPT_FORMATS, transcript_lines
from arena.site.access import STAFF, allow_only
from augment.models import GenerationJob


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID) -> StreamingHttpResponse:
    """A line of JSON for each augmentation, sent while the rest is read."""
    job = get_object_or_404(GenerationJob, code=code)
    form = TRANSCRIPT_FORMATS["jsonl"]
    name = f"{slugify(job.name) or 'job'}-transcripts.{form.suffix}"
    return StreamingHttpResponse(
        transcript_lines(job),
        content_type=form.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
