"""Tables, charts and zips of jobs and ratings as files, with the same bytes as on the pages."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from django.http import Http404
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from django.utils.text import slugify
from rest_framework.request import Request

from arena.api.access import STAFF
from arena.api.views import FileView, as_file, file_operation
from arena.errors import NoSnapshot
from arena.exports.bundle import bundle
from arena.exports.charts.rating import CONTENT_TYPES, chart_bytes
from arena.exports.formats import Format, format_named
from arena.exports.tables import leaderboard_table
from arena.exports.votes import VOTE_FORMATS, vote_table
from arena.exports.writers import FORMATS as LEADERBOARD
from arena.exports.zips import CONTENT_TYPE as ZIP_TYPE
from arena.jobs.exports import displacement, faults, tables
from arena.jobs.exports.displacement import FORMATS as DISPLACEMENT
from arena.jobs.exports.driving import FORMATS as DRIVING
from arena.jobs.exports.driving import DrivingTable
from arena.jobs.queries import analysis_of
from arena.models import Snapshot
from arena.results.api import get_snapshot
from augment.errors import UnknownName
from augment.models import GenerationJob
from augment.services.judging.displacement import By
from augment.services.judging.driving_scores import options_driven, scores_of_job
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.progress import tool_calls_by_augmentation

Export = tuple[Mapping[str, Format[Any]], Callable[[GenerationJob], Any]]
CHARTS = ("pairs", "types")


def _driving(score: str, job: GenerationJob) -> DrivingTable:
    known = options_driven(job)
    scores = scores_of_job(job, options=known[0] if known else Options(), score=score)
    return DrivingTable(title=job.name, scores=scores)


def _displacement(by: By, job: GenerationJob) -> Any:
    return displacement.displacement_table(job, by=by, types=None)


def _analysis(part: str, job: GenerationJob) -> Any:
    return tables.analysis_table(analysis_of(job), part)


OF_JOBS: dict[str, Export] = {
    "tool-calls": (tables.FORMATS, tool_calls_by_augmentation),
    "augmentations": (tables.AUGMENTATION_FORMATS, tables.augmentation_rows),
    "repeats": (tables.REPEAT_FORMATS, tables.repeat_rows),
    "faults": (faults.FORMATS, faults.fault_table),
    "displacement-objects": (displacement.OBJECT_FORMATS, displacement.object_rows),
    **{f"displacement-by-{by.value}": (DISPLACEMENT, partial(_displacement, by)) for by in By},
    **{f"driving-{score}": (DRIVING, partial(_driving, score)) for score in SCORES},
    **{
        f"analyses-{part}": (tables.ANALYSIS_FORMATS, partial(_analysis, part))
        for part in tables.PARTS
    },
}
"""Exports of a job by name: their formats, and what makes their table."""


class JobExportView(FileView):
    """A table of a job."""

    readers = STAFF

    @file_operation(
        "A table of a job as a file",
        types=[one.content_type for formats, _ in OF_JOBS.values() for one in formats.values()],
        name="exportJob",
        words={
            "name": OF_JOBS,
            "form": [form for formats, _ in OF_JOBS.values() for form in formats],
        },
    )
    def get(self, request: Request, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
        """The same bytes as on its page."""
        job = get_object_or_404(GenerationJob, code=code)
        if name not in OF_JOBS:
            raise Http404
        formats, table = OF_JOBS[name]
        chosen = _format(formats, form)
        content = chosen.write(table(job))
        stem = f"{slugify(job.name) or 'job'}-{name}"
        return as_file(content, chosen.content_type, f"{stem}.{chosen.suffix}")


class SnapshotExportView(FileView):
    """A rating as a file."""

    readers = STAFF

    @file_operation(
        "A rating as a file",
        types=[
            *(one.content_type for one in LEADERBOARD.values()),
            *(one.content_type for one in VOTE_FORMATS.values()),
            *CONTENT_TYPES.values(),
            ZIP_TYPE,
        ],
        name="exportSnapshot",
        words={
            "name": ["leaderboard", "votes", "all", *CHARTS],
            "form": [*LEADERBOARD, *VOTE_FORMATS, *CONTENT_TYPES, "zip"],
        },
    )
    def get(self, request: Request, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
        """Its table, votes, a chart, or all of them in a zip."""
        snapshot = get_snapshot(self, code)
        if snapshot.state != Snapshot.State.READY:
            raise NoSnapshot("This rating is not ready.")
        study = slugify(snapshot.study.name) or "study"
        if name == "all":
            if form != "zip":
                raise Http404
            return as_file(bundle(snapshot), ZIP_TYPE, f"{study}-rating.zip")
        if name == "leaderboard":
            chosen: Format[Any] = _format(LEADERBOARD, form)
            table: Any = leaderboard_table(snapshot)
        elif name == "votes":
            chosen, table = _format(VOTE_FORMATS, form), vote_table(snapshot)
        else:
            return _chart(snapshot, name, form, f"{study}-{name}.{form}")
        return as_file(chosen.write(table), chosen.content_type, f"{study}-{name}.{chosen.suffix}")


# --- Private -----------------------------------------------------------------------------------


def _format(formats: Mapping[str, Format[Any]], form: str) -> Format[Any]:
    try:
        return format_named(formats, form)
    except UnknownName as error:
        raise Http404 from error


def _chart(snapshot: Snapshot, name: str, form: str, file_name: str) -> HttpResponseBase:
    try:
        content = chart_bytes(snapshot, name=name, file_format=form)
    except UnknownName as error:
        raise Http404 from error
    return as_file(content, CONTENT_TYPES[form], file_name)
