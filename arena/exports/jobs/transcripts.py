"""All transcripts of a job in one file: a line of JSON for each, or a zip with their images."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from django.core.files.storage import default_storage

from arena.exports.formats import Format, formats
from arena.exports.zips import zip_bytes
from augment.models import Augmentation, GenerationJob
from augment.services.running.calls import IMAGES
from augment.services.running.transcript_records import record_of, tries_by_augmentation

AT_ONCE = 50
"""So many transcripts are read and held in memory together."""

LINES = "transcripts.jsonl"


def transcript_records(job: GenerationJob) -> Iterator[dict[str, Any]]:
    """A record for each augmentation as they were made, images by their SHA-256 alone."""
    rows = Augmentation.objects.filter(job=job).order_by("pk")
    keys = list(rows.values_list("pk", flat=True))
    for start in range(0, len(keys), AT_ONCE):
        part = keys[start : start + AT_ONCE]
        chosen = rows.filter(pk__in=part)
        tries = tries_by_augmentation(part)
        for row in chosen.select_related("job", "scenario", "contestant__endpoint"):
            record = record_of(row, tries.get(row.pk, []))
            yield record | {"images": sorted(record["images"])}


def transcript_lines(job: GenerationJob) -> Iterator[bytes]:
    """Each record as one line."""
    for record in transcript_records(job):
        yield (json.dumps(record, ensure_ascii=False) + "\n").encode()


def zip_of(job: GenerationJob) -> bytes:
    """The lines, and every image that one of them names and that is still there."""
    lines: list[bytes] = []
    images: set[str] = set()
    for record in transcript_records(job):
        images.update(record["images"])
        lines.append((json.dumps(record, ensure_ascii=False) + "\n").encode())
    files = {LINES: b"".join(lines)}
    for digest in sorted(images):
        name = f"{IMAGES}/{digest}.png"
        if default_storage.exists(name):
            with default_storage.open(name) as file:
                files[f"images/{digest}.png"] = file.read()
    return zip_bytes(files)


TRANSCRIPT_FORMATS: dict[str, Format[GenerationJob]] = formats(
    jsonl=lambda job: b"".join(transcript_lines(job)), zip=zip_of
)
