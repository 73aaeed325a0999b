"""Scenarios of a job or a study as one zip: files, and a manifest of what they are and lost."""

import json
import platform
from collections.abc import Iterator
from dataclasses import asdict
from importlib import metadata
from pathlib import Path

from django.core.files.base import ContentFile
from django.utils.text import slugify

from arena.exports.files import WARNING, describe_files, zip_bytes
from arena.exports.formats import Format, formats, json_bytes
from arena.exports.written_files import FileWork, MadeFile
from arena.models import ScenarioFile
from arena.studies.services.opening import product_version
from augment.models import Augmentation, GenerationJob
from augment.services.judging import Archive, export_job
from augment.services.running import make_record, tries_by_augmentation

MANIFEST = "manifest.json"
WRITTEN_WITH = ("numpy", "scenariogeneration", "shapely", "PyYAML")
"""What the bytes of the files depend on besides our own code."""


def scenario_zip(exported: Archive) -> bytes:
    """The zip; the same rows always give the same bytes."""
    files = dict(exported.written.files)
    if exported.warnings:
        files[WARNING] = ("\n".join(exported.warnings) + "\n").encode()
    written = exported.written
    document = {
        "format": "scenario-arena/scenarios",
        "version": 1,
        exported.origin.kind: {"name": exported.origin.name, "code": exported.origin.code},
        "scenarios_in": exported.format,
        "warnings": list(exported.warnings),
        "sources": [asdict(source) for source in exported.sources],
        "lost": [asdict(loss) for loss in written.losses],
        "refused": [asdict(loss) for loss in written.refused],
        "missing": [asdict(loss) for loss in exported.missing],
        "versions": {"scenario-arena": product_version(), "python": platform.python_version()}
        | {name: metadata.version(name) for name in WRITTEN_WITH},
        "files": describe_files(files),
    }
    files[MANIFEST] = json_bytes(document, sort_keys=True)
    return zip_bytes(files)


class ScenarioFiles(FileWork[ScenarioFile]):
    """Zips of jobs."""

    model = ScenarioFile
    related = ("job",)

    def make(self, row: ScenarioFile, folder: Path) -> MadeFile:
        """Return all scenarios of the job in the format."""
        exported = export_job(row.job, file_format=row.format)
        return pack_scenarios(exported, slugify(row.job.name) or str(row.job.code))


SCENARIO_FILES = ScenarioFiles()


def pack_scenarios(exported: Archive, slug: str) -> MadeFile:
    """Return scenarios as a zip; its name marks data that must not be used commercially."""
    marked = any(source.is_non_commercial for source in exported.sources)
    return MadeFile(
        name=f"{slug}-{exported.format}{'-non-commercial' * marked}.zip",
        content=ContentFile(scenario_zip(exported)),
        warnings=exported.warnings,
        marked=marked,
    )


AT_ONCE = 50
"""So many transcripts are read and held in memory together."""


def transcript_lines(job: GenerationJob) -> Iterator[bytes]:
    """Yield a line for each augmentation as they were made, images by their SHA-256 alone."""
    rows = Augmentation.objects.filter(job=job).order_by("pk")
    keys = list(rows.values_list("pk", flat=True))
    for start in range(0, len(keys), AT_ONCE):
        part = keys[start : start + AT_ONCE]
        tries = tries_by_augmentation(part)
        chosen = rows.filter(pk__in=part)
        for row in chosen.select_related("job", "scenario", "contestant__endpoint"):
            record = make_record(row, tries.get(row.pk, []))
            record["images"] = sorted(record["images"])
            yield (json.dumps(record, ensure_ascii=False) + "\n").encode()


TRANSCRIPT_FORMATS: dict[str, Format[GenerationJob]] = formats(
    jsonl=lambda job: b"".join(transcript_lines(job))
)
