"""How far a job's results are from the references: a part of the job's page, and its files."""

from __future__ import annotations

import uuid

from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.exports.formats import format_named
from arena.jobs.exports.displacement import displacement_table
from arena.jobs.exports.displacement_files import BY_OBJECT, FORMATS, OBJECT_FORMATS, object_rows
from arena.web.access import STAFF, allow_only
from augment.errors import UnknownName
from augment.models import GenerationJob
from augment.services.judging.displacement import By, types_named

LABELS = {By.CONTESTANT: "Contestant", By.TYPE: "Scenario type", By.VARIANT: "Variant"}


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The displacement errors of a job as a file; `by` as on the page."""
    job = get_object_or_404(GenerationJob, code=code)
    if request.GET.get("by") == BY_OBJECT:
        return _objects(job, form)
    by, types = read_grouping(request), types_asked(request)
    try:
        chosen = format_named(FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    name = f"{slugify(job.name) or 'job'}-displacement-by-{by}"
    if types is not None:
        name += "-all-types"
    return HttpResponse(
        chosen.write(displacement_table(job, by=by, types=types)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}.{chosen.suffix}"'},
    )


def _objects(job: GenerationJob, form: str) -> HttpResponse:
    """One row an object, of all five types."""
    try:
        chosen = format_named(OBJECT_FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    name = f"{slugify(job.name) or 'job'}-displacement-objects.{chosen.suffix}"
    return HttpResponse(
        chosen.write(object_rows(job)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


def section(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """What the part of the job's page shows."""
    by, types = read_grouping(request), types_asked(request)
    table = displacement_table(job, by=by, types=types)
    return {
        "table": table,
        "by": by,
        "labels": LABELS,
        "forms": FORMATS,
        "object_forms": OBJECT_FORMATS,
        "query": f"by={by}" + ("&types=all" if types is not None else ""),
        "has_choice": by is By.VARIANT,
        "is_all": types is not None,
    }


def read_grouping(request: HttpRequest) -> By:
    """What the address asks to group by: contestants, unless it says otherwise."""
    wanted = request.GET.get("by", By.CONTESTANT)
    return By(wanted) if wanted in set(By) else By.CONTESTANT


def types_asked(request: HttpRequest) -> tuple[str, ...] | None:
    """All five scenario types where the address asks for them, else the paper's choice."""
    return types_named(["all"]) if request.GET.get("types") == "all" else None
