"""The zip of a job's scenarios, as a worker writes it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from django.core.files.base import ContentFile
from django.utils.text import slugify

from arena.exports.written_files import FileWork, MadeFile
from arena.jobs.exports.files import scenario_zip, zip_name
from arena.models import ScenarioFile
from augment.services.judging.scenario_export import Exported, export_job


class ScenarioFiles(FileWork[ScenarioFile]):
    """Zips of jobs."""

    model = ScenarioFile
    related = ("job",)

    @contextmanager
    def made(self, row: ScenarioFile) -> Iterator[MadeFile]:
        """All scenarios of the job in the format."""
        exported = export_job(row.job, file_format=row.format)
        yield made_of(exported, slugify(row.job.name) or str(row.job.code))


SCENARIO_FILES = ScenarioFiles()


def made_of(exported: Exported, slug: str) -> MadeFile:
    """Scenarios as the file that is offered."""
    return MadeFile(
        name=zip_name(exported, slug),
        content=ContentFile(scenario_zip(exported)),
        warnings=exported.warnings,
        marked=any(source.is_non_commercial for source in exported.sources),
    )
