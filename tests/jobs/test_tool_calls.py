"""Calls of the function, counted from what the transcripts keep."""

from __future__ import annotations

import csv
import io

import pytest
from django.core.management import call_command

from augment.models import Attempt, Augmentation, TranscriptNote
from augment.services.running.progress import tool_calls_by_contestant
from tests.jobs.rows import NOON, launch
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db(transaction=True)


def note_calls(row: Augmentation, attempt: int, *calls: tuple[bool, bool]) -> None:
    made = Attempt.objects.create(augmentation=row, number=attempt, started_at=NOON)
    for number, (understood, mended) in enumerate(calls, start=1):
        document = {"understood": understood, "mended": mended, "result": {}}
        TranscriptNote.objects.create(
            attempt=made, number=number, after_call=1, kind="tool_call", document=document
        )


def test_calls_are_counted_per_contestant_in_the_page_and_the_files(
    capsys: pytest.CaptureFixture[str],
) -> None:
    job = launch(scenarios=2, contestants=("one", "other"))
    first, second = Augmentation.objects.filter(contestant__slug="one").order_by("scenario__slug")
    note_calls(first, 1, (False, False), (False, False))  # broke, and was tried again
    note_calls(first, 2, (True, False), (True, True), (False, False))
    note_calls(second, 1, (True, False))
    (line,) = tool_calls_by_contestant(job)
    assert (line.contestant, line.augmentations) == ("one", 2)
    assert (line.attempted, line.understood, line.mended) == (4, 3, 1)

    Augmentation.objects.update(state=Augmentation.State.FAILED)
    page = signed_in(people()["analyst"]).get(f"/jobs/{job.code}/").content.decode()
    assert 'id="tool-calls"' in page
    assert '<td class="num">4</td><td class="num">3</td><td class="num">1</td>' in page

    call_command("export", "tool-calls", str(job.code), out="-")
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [(row["scenario"], row["attempted"], row["mended"]) for row in rows] == [
        ("street-1", "3", "1"),
        ("street-2", "1", "0"),
    ]
