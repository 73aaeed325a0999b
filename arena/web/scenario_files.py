"""What a job made, as scenarios in a standard format: one zip a format."""

from __future__ import annotations

import uuid

from django.contrib import messages
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect
from django.utils.text import slugify
from django.utils.translation import gettext as _
from django.views.decorators.http import require_safe

from arena.exports.scenarios import scenario_zip, zip_name
from arena.exports.zips import CONTENT_TYPE
from arena.web.access import STAFF, allow_only
from augment.errors import AugmentError
from augment.models import GenerationJob
from augment.services.judging.scenario_export import FORMATS, export_job
from augment.services.wording import translate

MOST = 300
"""So many are written while somebody waits; more take the command."""


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """All scenarios of a job in one zip with a manifest."""
    job = get_object_or_404(GenerationJob, code=code)
    if form not in FORMATS:
        raise Http404
    if job.augmentations.exclude(modification=None).count() > MOST:
        text = _("More than %(most)s scenarios: write them with “manage.py export scenarios”.")
        messages.error(request, text % {"most": MOST})
        return redirect("job", code=code)
    try:
        exported = export_job(job, file_format=form)
    except AugmentError as error:
        messages.error(request, translate(error))
        return redirect("job", code=code)
    name = zip_name(exported, slugify(job.name) or str(job.code))
    return HttpResponse(
        scenario_zip(exported),
        content_type=CONTENT_TYPE,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
