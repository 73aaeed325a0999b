"""Zips of a job's scenarios: which are asked for, and which there are."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import ScenarioFile
from arena.results.services.written_files import waiting_row
from augment.errors import UnknownName
from augment.models import GenerationJob
from augment.services.events import log_event
from augment.services.judging.scenario_export import FORMATS


@transaction.atomic
def ask_for_file(
    *, job: GenerationJob, file_format: str, actor: User | None = None
) -> ScenarioFile:
    """A row for a worker to write; one that waits already is asked for once more.

    Raises:
        UnknownName: No such format.
    """
    if file_format not in FORMATS:
        raise UnknownName("format", file_format, list(FORMATS))
    row = ScenarioFile(job=job, format=file_format, asked_by=actor)
    if (waiting := waiting_row(row)) is not None:
        return waiting
    row.save()
    log_event(
        actor=actor,
        verb="ask for scenarios",
        object_kind="job",
        object_code=job.code,
        after={"format": file_format, "file": str(row.code)},
    )
    return row


def files_of(job: GenerationJob) -> dict[str, ScenarioFile]:
    """The newest row of each format."""
    return {row.format: row for row in ScenarioFile.objects.filter(job=job).order_by("pk")}
