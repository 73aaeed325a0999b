"""All of a study that can be taken away, in one place of its page; long ones by a worker."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.core.files.storage import default_storage
from django.db import transaction
from django.http import FileResponse, Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect
from django.urls import reverse
from django.views.decorators.http import require_POST, require_safe

from arena import tasks
from arena.models import Study, StudyFile
from arena.queries.studies.results import ResultsAccess, latest_snapshot, results_access
from arena.queries.votes.judged import is_imported
from arena.services.study_files import SHOWS_RESULTS, ask_for_study_file, study_files_of, why_not
from arena.site.access import STAFF, allow_only
from arena.site.acts import send_later
from augment.errors import AugmentError


@dataclass(frozen=True, slots=True, kw_only=True)
class FileLine:
    """One file that a worker writes.

    Attributes:
        row: The newest, None before the first.
        obstacle: Why nobody, or whoever looks, can have it now; empty where they can.
    """

    kind: str
    label: str
    row: StudyFile | None
    obstacle: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportPlace:
    """What there is to take away.

    Attributes:
        may_read: Whether whoever looks may read the study's results.
        is_rated: Whether there is a rating.
    """

    may_read: bool
    is_early: bool
    is_rated: bool
    is_imported: bool
    files: tuple[FileLine, ...]

    @property
    def is_waiting(self) -> bool:
        """Whether a worker still writes one."""
        return any(line.row is not None and line.row.is_waiting for line in self.files)


def export_place(study: Study, user: User) -> ExportPlace:
    """For the page of the study."""
    access = results_access(user=user, study=study)
    rows = study_files_of(study)
    return ExportPlace(
        may_read=access is ResultsAccess.FULL,
        is_early=access is ResultsAccess.EARLY,
        is_rated=latest_snapshot(study) is not None,
        is_imported=is_imported(study),
        files=tuple(
            FileLine(
                kind=kind.value,
                label=str(kind.label),
                row=rows.get(kind.value),
                obstacle=_obstacle(study, kind, access),
            )
            for kind in StudyFile.Kind
            if kind is StudyFile.Kind.STUDY or not is_imported(study)
        ),
    )


@allow_only(*STAFF)
@require_POST
def ask(request: HttpRequest, code: uuid.UUID, kind: str) -> HttpResponse:
    """Leave a file to a worker; twice does no harm."""
    study = _study_for(request, code, kind)
    try:
        with transaction.atomic():
            row = ask_for_study_file(study=study, kind=kind, actor=cast(User, request.user))
            send_later(request, tasks.send_study_file, row.pk)
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "A worker writes the file; it is offered here when ready.")
    if is_imported(study):
        return redirect("results", code=code)
    return redirect(reverse("study", args=[code]) + "#export")


@allow_only(*STAFF)
@require_safe
def download(request: HttpRequest, code: uuid.UUID, kind: str) -> FileResponse:
    """The newest one, once it is ready."""
    study = _study_for(request, code, kind)
    row = study_files_of(study).get(kind)
    if row is None or row.state != StudyFile.State.READY:
        raise Http404
    try:
        content = default_storage.open(row.stored)
    except FileNotFoundError:
        raise Http404 from None
    return FileResponse(content, as_attachment=True, filename=row.name)


# --- Private -----------------------------------------------------------------------------------


def _study_for(request: HttpRequest, code: uuid.UUID, kind: str) -> Study:
    """The study, for whoever may have this of it."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if kind not in StudyFile.Kind.values:
        raise Http404
    access = results_access(user=cast(User, request.user), study=study)
    if kind in SHOWS_RESULTS and access is not ResultsAccess.FULL:
        raise PermissionDenied
    return study


def _obstacle(study: Study, kind: StudyFile.Kind, access: ResultsAccess) -> str:
    if reason := why_not(study, kind):
        return reason
    if kind in SHOWS_RESULTS and access is not ResultsAccess.FULL:
        return "It shows results, which you have not opened."
    return ""
