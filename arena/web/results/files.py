"""A rating as files; the same rating always gives the same bytes."""

from __future__ import annotations

import uuid

from django.contrib import messages
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.errors import NoSnapshot
from arena.exports.bundle import bundle
from arena.exports.charts.rating import CONTENT_TYPES, chart_bytes
from arena.exports.formats import format_named
from arena.exports.tables import leaderboard_table
from arena.exports.votes import VOTE_FORMATS, unrated_votes, vote_table
from arena.exports.writers import FORMATS
from arena.exports.zips import CONTENT_TYPE, ZIP
from arena.models import Snapshot, Study
from arena.queries.studies.results import snapshot_to_export
from arena.site.access import ADMIN, ANALYST, EXPERT, STAFF, allow_only
from arena.web.results.pages import asked_rating, get_readable_study
from augment.errors import Conflict, UnknownName


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The rating that the address names, else the newest, as a file or as all of them in a zip."""
    study = get_readable_study(request, code)
    snapshot = _snapshot(request, study)
    if form == ZIP:
        try:
            content = bundle(snapshot)
        except Conflict as error:
            messages.error(request, str(error))
            return redirect("results", code=code)
        return _file(content, CONTENT_TYPE, f"{_slug(study)}-rating.zip")
    try:
        chosen = format_named(FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    content = chosen.write(leaderboard_table(snapshot))
    return _file(content, chosen.content_type, f"{_slug(study)}-leaderboard.{chosen.suffix}")


@allow_only(ADMIN, ANALYST, EXPERT)
@require_safe
def export_chart(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponse:
    """A chart of a rating for whoever may read it: a picture of its page, or a file."""
    study = get_readable_study(request, code)
    snapshot = _snapshot(request, study)
    try:
        content = chart_bytes(snapshot, name=name, file_format=form)
    except UnknownName as error:
        raise Http404 from error
    return _file(content, CONTENT_TYPES[form], f"{_slug(study)}-{name}.{form}")


@allow_only(*STAFF)
@require_safe
def export_votes(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The votes of a rating, with pseudonyms; of a cancelled study, which has none, all votes."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    is_cancelled = study.state == Study.State.CANCELLED
    if not is_cancelled:
        study = get_readable_study(request, code)
    try:
        chosen = format_named(VOTE_FORMATS, form)
        rows = unrated_votes(study) if is_cancelled else vote_table(_snapshot(request, study))
    except UnknownName as error:
        raise Http404 from error
    except Conflict as error:
        messages.error(request, str(error))
        return redirect("results", code=code)
    name = f"{_slug(study)}-votes.{chosen.suffix}"
    return _file(chosen.write(rows), chosen.content_type, name)


def _snapshot(request: HttpRequest, study: Study) -> Snapshot:
    try:
        return snapshot_to_export(study, asked_rating(request))
    except NoSnapshot as error:
        raise Http404 from error


def _slug(study: Study) -> str:
    return slugify(study.name) or "study"


def _file(content: bytes, content_type: str, name: str) -> HttpResponse:
    return HttpResponse(
        content,
        content_type=content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
