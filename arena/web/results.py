"""The results of a closed study."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.views.decorators.http import require_POST, require_safe

from arena.errors import ArenaError, NoSnapshot
from arena.exports.tables import leaderboard_table
from arena.exports.writers import format_named
from arena.models import Study
from arena.queries.results import (
    ResultsAccess,
    latest_snapshot,
    results_access,
    snapshot_to_export,
)
from arena.services.ratings import rate
from arena.web.access import ADMIN, ANALYST, EXPERT, STAFF, only
from arena.web.charts import interval_chart
from augment.errors import AugmentError, UnknownName


@only(ADMIN, ANALYST, EXPERT)
@require_safe
def results_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Table and chart of the newest rating; refused until the study is closed."""
    study = _readable(request, code)
    snapshot = latest_snapshot(study)
    context: dict[str, object] = {"study": study, "snapshot": snapshot}
    if snapshot is not None:
        table = leaderboard_table(snapshot)
        context |= {"table": table, "chart": interval_chart(table.rows)}
    return render(request, "studies/results.html", context)


@only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The newest rating as a file; the same rating always gives the same bytes."""
    study = _readable(request, code)
    try:
        chosen = format_named(form)
        snapshot = snapshot_to_export(study)
    except (UnknownName, NoSnapshot) as error:
        raise Http404 from error
    name = f"{slugify(study.name) or 'study'}-leaderboard.{chosen.suffix}"
    return HttpResponse(
        chosen.write(leaderboard_table(snapshot)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@only(*STAFF)
@require_POST
def rate_study(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Compute a new rating from the votes as they are now, and keep it."""
    study = _readable(request, code)
    try:
        rate(study=study, actor=cast(User, request.user))
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    return redirect("results", code=code)


def _readable(request: HttpRequest, code: uuid.UUID) -> Study:
    study = get_object_or_404(Study, code=code)
    if results_access(user=cast(User, request.user), study=study) is not ResultsAccess.FULL:
        raise PermissionDenied
    return study
