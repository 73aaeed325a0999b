"""Files of a study that workers write: which there can be, asked for, and the newest."""

from __future__ import annotations

from django.contrib.auth.models import User

from arena.exports.written_files import ask_for
from arena.models import Snapshot, Study, StudyFile
from arena.voting.queries.blinding import is_imported
from augment.errors import Conflict, check_names

Kind = StudyFile.Kind


SHOWS_RESULTS = (Kind.STUDY, Kind.RATING)
"""Kinds for those alone who may read the study's results."""


def why_not(study: Study, kind: str) -> str:
    """A sentence where there can be no such file now, empty where there can.

    Whether somebody may read the study's results is asked elsewhere.

    Raises:
        UnknownName: There is no such kind.
    """
    check_names("file of a study", [kind], Kind.values)
    is_cancelled = study.state == Study.State.CANCELLED
    if kind == Kind.STUDY:
        if study.state == Study.State.OPEN:
            return "It is written once the study is closed: what still changes is no whole."
        if is_cancelled:
            return "A cancelled study is not written as a whole; its votes can be exported."
    elif kind == Kind.RATING:
        if is_cancelled:
            return "The study was cancelled: it has no results."
        if not study.snapshots.filter(state=Snapshot.State.READY).exists():
            return "Rate the study first: the file has the tables and charts of a rating."
    elif is_imported(study):
        return "Votes from a file have no pictures."
    return ""


def ask_for_study_file(*, study: Study, kind: str, actor: User | None = None) -> StudyFile:
    """Return a row for a worker to write; one that waits already is asked for once more.

    Raises:
        UnknownName: There is no such kind.
        Conflict: There can be no such file now.
    """
    if reason := why_not(study, kind):
        raise Conflict(reason)
    return ask_for(StudyFile(study=study, kind=kind, asked_by=actor), study, file=kind)


def newest_study_files(study: Study) -> dict[str, StudyFile]:
    """The newest row of each kind."""
    return {row.kind: row for row in study.files.order_by("pk")}
