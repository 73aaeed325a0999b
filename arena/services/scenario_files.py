"""Rows of zips of scenarios: asked for, being written, ready, failed."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import partial

from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.db import transaction
from django.utils import timezone

from arena.models import ScenarioFile
from augment.errors import UnknownName
from augment.models import GenerationJob
from augment.services.events import log_event
from augment.services.judging.scenario_export import FORMATS

State = ScenarioFile.State
LONGEST_FAULT = 500
FOLDER = "scenario-files"
"""Where the zips lie, among the pictures; a backup leaves them out, they can be made again."""


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
    waiting = ScenarioFile.objects.filter(
        job=job, format=file_format, state__in=[State.QUEUED, State.RUNNING]
    )
    row = waiting.first()
    if row is not None:
        return row
    row = ScenarioFile.objects.create(job=job, format=file_format, asked_by=actor)
    log_event(
        actor=actor,
        verb="ask for scenarios",
        object_kind="job",
        object_code=job.code,
        after={"format": file_format, "file": str(row.code)},
    )
    return row


def begin_file(*, file_pk: int) -> ScenarioFile | None:
    """The row that is to be written now; None for one that is gone, ready or failed."""
    waiting = ScenarioFile.objects.filter(pk=file_pk, state__in=[State.QUEUED, State.RUNNING])
    if not waiting.update(state=State.RUNNING):
        return None
    return ScenarioFile.objects.select_related("job").get(pk=file_pk)


def keep_file(
    row: ScenarioFile, *, name: str, content: bytes, warnings: Sequence[str], marked: bool
) -> None:
    """Store the zip; those of the same job and format before it go.

    Args:
        row: As `begin_file` gave it.
        name: What it is called for people.
        content: The zip.
        warnings: What whoever passes it on has to know.
        marked: Whether data that must not be used commercially is in it.
    """
    stored = f"{FOLDER}/{row.code}.zip"
    if default_storage.exists(stored):  # a worker that died left it
        default_storage.delete(stored)
    kept = default_storage.save(stored, ContentFile(content))
    with transaction.atomic():
        ScenarioFile.objects.filter(pk=row.pk).update(
            state=State.READY,
            name=name,
            stored=kept,
            size_bytes=len(content),
            digest=hashlib.sha256(content).hexdigest(),
            warnings=list(warnings),
            is_non_commercial=marked,
            finished_at=timezone.now(),
        )
        older = ScenarioFile.objects.filter(job=row.job, format=row.format, pk__lt=row.pk)
        gone = [one for one in older.values_list("stored", flat=True) if one]
        older.delete()
        for one in gone:
            transaction.on_commit(partial(default_storage.delete, one))


def note_failure(row: ScenarioFile, why: str) -> None:
    """Say on the row why there is no zip."""
    unready = ScenarioFile.objects.filter(pk=row.pk).exclude(state=State.READY)
    unready.update(state=State.FAILED, fault=why[:LONGEST_FAULT], finished_at=timezone.now())


def files_of(job: GenerationJob) -> dict[str, ScenarioFile]:
    """The newest row of each format."""
    return {row.format: row for row in ScenarioFile.objects.filter(job=job).order_by("pk")}
