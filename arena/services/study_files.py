"""Files of a study that a worker writes: which may be asked for, and which there are."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Snapshot, Study, StudyFile
from arena.queries.votes.judged import is_imported
from arena.services.written_files import waiting_row
from augment.errors import Conflict, UnknownName
from augment.services.events import log_event

Kind = StudyFile.Kind

SHOWS_RESULTS = (Kind.STUDY, Kind.CONTACT_SHEET)
"""Kinds for those alone who may read the study's results."""


def why_not(study: Study, kind: str) -> str:
    """A sentence where there can be no such file now, empty where there can.

    Whether somebody may read the study's results is asked elsewhere.

    Raises:
        UnknownName: There is no such kind.
    """
    if kind not in Kind.values:
        raise UnknownName("file of a study", kind, list(Kind.values))
    if kind == Kind.STUDY:
        if study.state == Study.State.OPEN:
            return "It is written once the study is closed: what still changes is no whole."
        if study.state == Study.State.CANCELLED:
            return "A cancelled study is not written as a whole; its votes can be exported."
        return ""
    if is_imported(study):
        return "Votes from a file have no pictures."
    if kind == Kind.CONTACT_SHEET:
        if study.state == Study.State.CANCELLED:
            return "The study was cancelled: it has no results."
        if not study.snapshots.filter(state=Snapshot.State.READY).exists():
            return "Rate the study first: the sheet has the votes of a rating."
    return ""


@transaction.atomic
def ask_for_study_file(*, study: Study, kind: str, actor: User | None = None) -> StudyFile:
    """A row for a worker to write; one that waits already is asked for once more.

    Raises:
        UnknownName: There is no such kind.
        Conflict: There can be no such file now.
    """
    if reason := why_not(study, kind):
        raise Conflict(reason)
    row = StudyFile(study=study, kind=kind, asked_by=actor)
    if (waiting := waiting_row(row)) is not None:
        return waiting
    row.save()
    log_event(
        actor=actor,
        verb="ask for a file",
        object_kind="study",
        object_code=study.code,
        after={"file": kind},
    )
    return row


def study_files_of(study: Study) -> dict[str, StudyFile]:
    """The newest row of each kind."""
    return {row.kind: row for row in study.files.order_by("pk")}
