"""Tables, charts and zips of jobs and ratings as files: the same bytes as on the pages."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.core.files.storage import default_storage
from django.db import transaction
from django.http import FileResponse, Http404
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from django.utils.text import slugify
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena import tasks
from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import CodeField, StrictSerializer
from arena.api.files import FileView, as_file, describe_file, job_name
from arena.api.schema import describe
from arena.api.snapshots import get_snapshot
from arena.errors import NoSnapshot
from arena.exports import (
    analyses,
    augmentations,
    displacement_objects,
    displacement_table,
    faults,
    tool_calls,
)
from arena.exports.bundle import bundle
from arena.exports.displacement_writers import FORMATS as DISPLACEMENT
from arena.exports.driving_table import DrivingTable
from arena.exports.driving_writers import FORMATS as DRIVING
from arena.exports.formats import Format, format_named
from arena.exports.rating_charts import CONTENT_TYPES, chart_bytes
from arena.exports.tables import leaderboard_table
from arena.exports.votes import VOTE_FORMATS, vote_table
from arena.exports.writers import FORMATS as LEADERBOARD
from arena.exports.zips import CONTENT_TYPE as ZIP_TYPE
from arena.models import ScenarioFile, Snapshot
from arena.queries.analyses import analysis_of
from arena.services.scenario_files import ask_for_file
from augment.errors import QueueFault, UnknownName
from augment.models import GenerationJob
from augment.services.judging.displacement import By
from augment.services.judging.driving_scores import options_driven, scores_of_job
from augment.services.judging.scenario_export import FORMATS as SCENARIO_FORMATS
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.tool_calls import tool_calls_by_augmentation
from augment.services.wording import translate

Export = tuple[Mapping[str, Format[Any]], Callable[[GenerationJob], Any]]
CHARTS = ("pairs", "types")


def _driving(score: str, job: GenerationJob) -> DrivingTable:
    known = options_driven(job)
    scores = scores_of_job(job, options=known[0] if known else Options(), score=score)
    return DrivingTable(title=job.name, scores=scores)


def _displacement(by: By, job: GenerationJob) -> Any:
    return displacement_table.displacement_table(job, by=by, types=None)


def _analysis(part: str, job: GenerationJob) -> Any:
    return analyses.analysis_table(analysis_of(job), part)


OF_JOBS: dict[str, Export] = {
    "tool-calls": (tool_calls.FORMATS, tool_calls_by_augmentation),
    "augmentations": (augmentations.AUGMENTATION_FORMATS, augmentations.augmentation_rows),
    "repeats": (augmentations.REPEAT_FORMATS, augmentations.repeat_rows),
    "faults": (faults.FORMATS, faults.fault_table),
    "displacement-objects": (
        displacement_objects.OBJECT_FORMATS,
        displacement_objects.object_rows,
    ),
    **{f"displacement-by-{by.value}": (DISPLACEMENT, partial(_displacement, by)) for by in By},
    **{f"driving-{score}": (DRIVING, partial(_driving, score)) for score in SCORES},
    **{
        f"analyses-{part}": (analyses.ANALYSIS_FORMATS, partial(_analysis, part))
        for part in analyses.PARTS
    },
}
"""What a job can be exported as, by name."""


class JobExportView(FileView):
    """A table of a job."""

    permission_classes = (StaffOnly,)

    @describe_file(
        "A table of a job as a file",
        types=[one.content_type for formats, _ in OF_JOBS.values() for one in formats.values()],
        name="exportJob",
        words={
            "name": OF_JOBS,
            "form": [form for formats, _ in OF_JOBS.values() for form in formats],
        },
    )
    def get(self, request: Request, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
        """The bytes that the page of the job offers."""
        job = get_object_or_404(GenerationJob, code=code)
        if name not in OF_JOBS:
            raise Http404
        formats, table = OF_JOBS[name]
        chosen = _format(formats, form)
        content = chosen.write(table(job))
        return as_file(content, chosen.content_type, f"{job_name(job)}-{name}.{chosen.suffix}")


class SnapshotExportView(FileView):
    """A rating as a file."""

    permission_classes = (StaffOnly,)
    read_errors = (409,)

    @describe_file(
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
        """Its table, its votes, a chart, or all of them; always the same bytes."""
        snapshot = get_snapshot(request, code)
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


class ScenarioFileBody(StrictSerializer):
    """Which job's scenarios in which format."""

    job = CodeField()
    format = serializers.ChoiceField(choices=list(SCENARIO_FORMATS))


class ScenarioFileDocument(serializers.Serializer[Any]):
    """A zip of a job's scenarios, written by a worker."""

    code = serializers.UUIDField()
    job = serializers.UUIDField(source="job.code")
    format = serializers.CharField()
    state = serializers.CharField(help_text="queued, running, ready or failed.")
    fault = serializers.CharField(help_text="Why there is none.")
    name = serializers.CharField()
    size_bytes = serializers.IntegerField(allow_null=True)
    warnings = serializers.ListField(child=serializers.CharField())


class ScenarioFilesView(ApiView):
    """Zips of scenarios are asked for here."""

    permission_classes = (StaffOnly,)

    @describe(
        "Have a job's scenarios written in a standard format",
        takes=ScenarioFileBody,
        answers=ScenarioFileDocument,
        status=202,
        name="askForScenarioFile",
    )
    def post(self, request: Request) -> Response:
        """One that waits already is asked for once more."""
        body = ScenarioFileBody(data=request.data)
        body.is_valid(raise_exception=True)
        job = get_object_or_404(GenerationJob, code=body.validated_data["job"])
        warnings: list[str] = []
        with transaction.atomic():
            row = ask_for_file(
                job=job,
                file_format=body.validated_data["format"],
                actor=cast(User, request.user),
            )
            transaction.on_commit(partial(_send, warnings, row.pk))
        found = dict(ScenarioFileDocument(row).data)
        return Response(found | {"warnings": [*found["warnings"], *warnings]}, status=202)


class ScenarioFileView(ApiView):
    """One zip of scenarios."""

    permission_classes = (StaffOnly,)

    @describe("How far a zip is", answers=ScenarioFileDocument, name="getScenarioFile")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Its content is at `.../content` once it is ready."""
        rows = ScenarioFile.objects.select_related("job")
        return Response(ScenarioFileDocument(get_object_or_404(rows, code=code)).data)


class ScenarioFileContentView(FileView):
    """The zip itself."""

    permission_classes = (StaffOnly,)

    @describe_file("A zip of scenarios", types=[ZIP_TYPE], name="downloadScenarioFile")
    def get(self, request: Request, code: uuid.UUID) -> HttpResponseBase:
        """Once it is ready."""
        row = get_object_or_404(ScenarioFile, code=code, state=ScenarioFile.State.READY)
        try:
            content = default_storage.open(row.stored)
        except FileNotFoundError:
            raise Http404 from None
        return FileResponse(content, as_attachment=True, filename=row.name, content_type=ZIP_TYPE)


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


def _send(warnings: list[str], file_pk: int) -> None:
    try:
        tasks.send_scenario_file(file_pk)
    except QueueFault as error:
        warnings.append(translate(error))
