"""Every transcript of a job in one call: the same records as one by one."""

import json
from pathlib import Path

import pytest
from django.core.management import call_command

from augment.models import Augmentation, GenerationJob
from augment.services.running import runner
from augment.services.running.transcript_records import full_transcript
from tests.jobs.models import Model, after_a_second_look, llama_job

pytestmark = pytest.mark.django_db


@pytest.fixture
def job() -> GenerationJob:
    """One augmentation that asked twice."""
    made = llama_job(price="2")
    row = Augmentation.objects.get(job=made)
    runner.Augmentations(Model(after_a_second_look)).perform(row.pk, worker="w")
    return made


def alone(row: Augmentation) -> dict[str, object]:
    """Its own transcript, with the names of its images."""
    record: dict[str, object] = json.loads(json.dumps(full_transcript(row)))
    images = record["images"]
    assert isinstance(images, dict)
    return record | {"images": sorted(images)}


def test_a_line_for_each_augmentation_is_its_transcript(
    job: GenerationJob, tmp_path: Path
) -> None:
    out = tmp_path / "all.jsonl"
    call_command("export", "transcripts", job.name, "--out", str(out))
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    assert lines == [alone(row) for row in Augmentation.objects.filter(job=job).order_by("pk")]
    (attempt,) = lines[0]["attempts"]
    assert len(attempt["steps"]) == 2
