"""The realism of a job as a table, as files and on its page."""

import csv
import io
import json
import re

import pyarrow.parquet as parquet
import pytest

from arena.jobs.exports.realism import FORMATS
from augment.metrics.realism import REALISM_VERSION
from augment.models import BaseScene, Contestant, GenerationJob
from augment.scene.codec import modification_to_document, scene_to_document
from augment.scene.entities import Modification
from augment.services.judging.realism import REALISM, realism_of_job
from augment.tasks import measure
from tests.jobs import rows
from tests.scenes import scene, vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

QUEUE = tuple(vehicle(f"Agent{n + 2}", -45.0 + 7.0 * n, 3.5, 3.14) for n in range(21))
PARKED = Modification(added=(vehicle("new", 30.0, 0.0),))
WILD = Modification(added=(vehicle("new", 3.0, -4.0, 1.0),))


def a_job() -> GenerationJob:
    """Two scenes with a queue of cars; ann parks well, bob wildly, and bob refuses once."""
    job = GenerationJob.objects.create(name="Round 1")
    cast = [rows.add_kind(slug, Contestant.Kind.RULE) for slug in ("ann", "bob")]
    for number in (1, 2):
        street = scene(name=f"queue-{number}", agents=QUEUE)
        scenario = rows.add_scenario(
            f"queue-{number}",
            scene=street,
            reference=modification_to_document(PARKED),
            keep_traffic=True,
        )
        for who, change in zip(cast, (PARKED, WILD), strict=True):
            is_refused = who.slug == "bob" and number == 2
            rows.add_answer(job, scenario, who, None if is_refused else change)
    return job


def test_contestants_stand_between_recorded_traffic_and_random_places() -> None:
    job = a_job()
    table = realism_of_job(job)
    names = ["Recorded traffic", "Reference", "ann", "bob", "Random placement"]
    assert [line.name for line in table.lines] == names
    recorded, reference, ann, bob, thrown = table.lines
    means = [line.mean or 0.0 for line in (recorded, reference, thrown)]
    assert means == sorted(means, reverse=True)
    assert (ann.mean, ann.scores) == (reference.mean, reference.scores)
    assert bob.scores["collision"] == 1.0
    assert (bob.changes, bob.left_out, bob.objects) == (1, 1, 1)
    assert ann.recorded == recorded.recorded == recorded.mean
    assert (recorded.objects, table.scenes) == (42, 2)
    by_row = REALISM.of(list(job.augmentations.values_list("pk", flat=True)))
    refused = job.augmentations.get(state="refused")
    assert len(by_row) == 3
    assert refused.pk not in by_row


def test_a_scene_is_not_judged_by_itself() -> None:
    job = a_job()
    BaseScene.objects.filter(slug="queue-2-scene").update(
        document=scene_to_document(scene(name="empty"))
    )
    job.augmentations.filter(scenario__slug="queue-2").delete()
    assert [line.mean for line in realism_of_job(job).lines] == [None] * 5


def test_files_and_page_state_the_version_and_the_answer() -> None:
    job = a_job()
    table = realism_of_job(job)
    written = {name: form.write(table) for name, form in FORMATS.items()}
    lines = list(csv.DictReader(io.StringIO(written["csv"].decode())))
    assert [line["row"] for line in lines] == [
        *("recording", "reference", "contestant", "contestant", "random")
    ]
    assert {line["version"] for line in lines} == {str(REALISM_VERSION)}
    assert json.loads(written["json"])["realism_version"] == REALISM_VERSION
    assert parquet.read_table(io.BytesIO(written["parquet"])).num_rows == 5
    assert f"Realism, version {REALISM_VERSION}" in written["latex"].decode()
    measure(job.pk)
    shown = signed_in(people()["researcher"]).get(f"/jobs/{job.code}/realism/").content.decode()
    assert re.search(r"is ann with 0\.\d\d over 2 changes; recorded traffic has 0\.\d\d", shown)
