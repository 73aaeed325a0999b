"""How far a job's results are from the references: a part of the job's page, and its files."""

from __future__ import annotations

import uuid

from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.exports.displacement_table import displacement_table
from arena.exports.displacement_writers import format_named
from arena.web.access import STAFF, only
from arena.web.boxes import box_sheet
from augment.errors import UnknownName
from augment.models import GenerationJob
from augment.services.displacement import By

LABELS = {By.CONTESTANT: "Contestant", By.TYPE: "Scenario type", By.VARIANT: "Variant"}


@only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The displacement errors of a job as a file; `by` as on the page."""
    job = get_object_or_404(GenerationJob, code=code)
    by = asked(request)
    try:
        chosen = format_named(form)
    except UnknownName as error:
        raise Http404 from error
    name = f"{slugify(job.name) or 'job'}-displacement-by-{by}.{chosen.suffix}"
    return HttpResponse(
        chosen.write(displacement_table(job, by=by)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


def section(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """What the part of the job's page shows."""
    by = asked(request)
    table = displacement_table(job, by=by)
    return {"table": table, "sheet": box_sheet(table), "by": by, "labels": LABELS}


def asked(request: HttpRequest) -> By:
    """What the address asks to group by: contestants, unless it says otherwise."""
    wanted = request.GET.get("by", By.CONTESTANT)
    return By(wanted) if wanted in set(By) else By.CONTESTANT
