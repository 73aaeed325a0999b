"""A job goes out as scenarios in one zip that says what it is."""

import hashlib
import json
import zipfile
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import pytest
import yaml
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import CommandError, call_command
from django.test import Client
from django.urls import reverse

from arena.exports.written_files import MadeFile, keep_file
from arena.jobs.exports.files import SCENARIO_FILES
from arena.models import ScenarioFile
from arena.studies.services.opening import product_version
from augment.formats.interplan.file import scene_token
from augment.formats.writers import WRITERS
from augment.models import BaseScene, Contestant, GenerationJob, Scenario
from augment.scene.codec import scene_from_document, scene_to_document
from augment.scene.entities import Modification, ScenarioType
from augment.services.scenarios.catalogue import load_catalogue
from augment.services.scenarios.scenes import LoadedScenario, NewScenario, add_scenario
from tests.fixtures.shelf import FOLDER
from tests.jobs import rows
from tests.scenes import junction, pedestrian, vehicle

pytestmark = pytest.mark.django_db

ADDED = Modification(
    added=(vehicle("Agent2", 12.0, 0.5), pedestrian("Agent3", 30.0, -5.0, (30.0, 6.0)))
)


@pytest.fixture
def job() -> GenerationJob:
    """One modification by the rule placer, and nothing from a contestant that refused."""
    BaseScene.objects.create(
        slug="junction",
        document=scene_to_document(junction()),
        source="json",
        provenance="Recorded somewhere; CC BY-NC-SA 4.0",
    )
    new = NewScenario(
        scene="junction", type=ScenarioType.NUDGE.value, instruction="Park a car.", slug="park"
    )
    scenario = add_scenario(new)
    job = GenerationJob.objects.create(name="Round 1")
    for slug, change in (("rule", ADDED), ("shy", None)):
        rows.add_answer(job, scenario, rows.add_kind(slug, Contestant.Kind.RULE), change)
    return job


def export(*options: str) -> str:
    err = StringIO()
    call_command("export", "scenarios", "Round 1", *options, stdout=StringIO(), stderr=err)
    return err.getvalue()


def manifest_of(archive: zipfile.ZipFile) -> dict[str, Any]:
    made: dict[str, Any] = json.loads(archive.read("manifest.json"))
    return made


@pytest.mark.parametrize("form", sorted(WRITERS))
def test_each_format_is_a_zip_with_manifest(form: str, job: GenerationJob, tmp_path: Path) -> None:
    said = export("--format", form, "--out", str(tmp_path / "new" / "folder"))
    (file,) = (tmp_path / "new" / "folder").iterdir()
    assert file.name == f"round-1-{form}-non-commercial.zip"
    with zipfile.ZipFile(file) as archive:
        manifest = manifest_of(archive)
        for name, entry in manifest["files"].items():
            assert hashlib.sha256(archive.read(name)).hexdigest() == entry["sha256"]
        assert set(archive.namelist()) == {*manifest["files"], "manifest.json"}
        assert b"commercial" in archive.read("WARNING.txt")
    assert manifest["scenarios_in"] == form
    assert manifest["versions"]["scenario-arena"] == product_version()
    assert {"python", "numpy", "scenariogeneration"} <= manifest["versions"].keys()
    assert manifest["sources"][0]["is_non_commercial"] is True
    assert manifest["missing"][0]["text"] == "there is no modification: refused"
    assert not manifest["refused"]
    assert all(loss["text"] in said for loss in manifest["lost"])
    assert "Warning: Made from data that must not be used commercially: junction" in said


def test_the_own_format_comes_back_exactly(job: GenerationJob, tmp_path: Path) -> None:
    export("--format", "json", "--out", str(tmp_path / "own.zip"))
    with zipfile.ZipFile(tmp_path / "own.zip") as archive:
        before = scene_from_document(json.loads(archive.read("park--rule.before.json")))
        after = scene_from_document(json.loads(archive.read("park--rule.scene.json")))
        assert manifest_of(archive)["lost"] == []
    assert before == junction()
    assert after.agents == ADDED.added


def ask_for(client: Client, job: GenerationJob, form: str) -> None:
    """Press the button, and be the worker that it asks."""
    client.post(reverse("scenarios-write", args=[job.code, form]))
    for row in ScenarioFile.objects.filter(state=ScenarioFile.State.QUEUED):
        SCENARIO_FILES.perform(row.pk)


def page_of(client: Client, job: GenerationJob) -> str:
    return client.get(reverse("job-tab", args=[job.code, "files"])).content.decode()


def test_a_worker_writes_the_zip_of_a_jobs_page(job: GenerationJob, admin_client: Client) -> None:
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    for form in WRITERS:
        assert reverse("scenarios-write", args=[job.code, form]) in page_of(admin_client, job)
    admin_client.post(reverse("scenarios-write", args=[job.code, "commonroad"]))
    row = ScenarioFile.objects.get()
    waiting = page_of(admin_client, job)
    assert all(word in waiting for word in ("waits for a worker", "data-live"))
    assert admin_client.get(reverse("scenarios-export", args=[row.code])).status_code == 404
    admin_client.post(reverse("scenarios-write", args=[job.code, "commonroad"]))
    assert ScenarioFile.objects.count() == 1, "one that waits is asked for once more"
    SCENARIO_FILES.perform(row.pk)
    page = page_of(admin_client, job)
    assert "Not for commercial use." in page
    assert "data-live" not in page
    assert "must not be used commercially: junction" in page
    answer = admin_client.get(reverse("scenarios-export", args=[row.code]))
    assert "round-1-commonroad-non-commercial.zip" in answer["Content-Disposition"]
    content = b"".join(answer)
    row.refresh_from_db()
    assert (row.size_bytes, row.digest) == (len(content), hashlib.sha256(content).hexdigest())
    with zipfile.ZipFile(BytesIO(content)) as archive:
        assert "park--rule.xml" in archive.namelist()


def test_a_message_that_comes_twice_changes_nothing_and_a_new_zip_replaces_the_old(
    job: GenerationJob, admin_client: Client, django_capture_on_commit_callbacks: Any
) -> None:
    ask_for(admin_client, job, "json")
    first = ScenarioFile.objects.get()
    SCENARIO_FILES.perform(first.pk)
    assert ScenarioFile.objects.get().finished_at == first.finished_at
    with django_capture_on_commit_callbacks(execute=True):
        ask_for(admin_client, job, "json")
    (second,) = ScenarioFile.objects.all()
    assert second.pk != first.pk
    assert not default_storage.exists(first.stored)
    assert default_storage.exists(second.stored)


def test_a_zip_that_a_newer_one_overtook_leaves_no_file(
    job: GenerationJob, django_capture_on_commit_callbacks: Any
) -> None:
    slow, fast = (ScenarioFile.objects.create(job=job, format="json") for _ in range(2))
    held = {row: SCENARIO_FILES.take(row.pk) for row in (slow, fast)}
    with django_capture_on_commit_callbacks(execute=True):
        for row in (fast, slow):
            keep_file(row, held[row], MadeFile(name="a.zip", content=ContentFile(b"zip")))
    (left,) = ScenarioFile.objects.all()
    assert (left, left.is_waiting) == (fast, False)
    assert default_storage.exists(left.stored)
    assert not default_storage.exists(f"{ScenarioFile.FOLDER}/{slow.code}.zip")


INTERPLAN = ("crash-mill-junction", "overtake-mill-junction", "nudge-ferry-road")


def test_a_job_goes_to_interplans_file_and_who_refused_is_named(tmp_path: Path) -> None:
    load_catalogue(folder=FOLDER)
    Scenario.objects.filter(slug__in=INTERPLAN).update(keep_traffic=False)
    job = GenerationJob.objects.create(name="Round 1")
    reference, rule = rows.add_kind("reference"), rows.add_kind("rule", Contestant.Kind.RULE)
    for scenario in Scenario.objects.filter(slug__in=INTERPLAN):
        rows.add_answer(job, scenario, reference, LoadedScenario(scenario).reference)
        rows.add_answer(job, scenario, rule)
    said = export("--format", "interplan", "--out", str(tmp_path / "interplan.zip"))
    assert "Left out: crash-mill-junction by rule: there is no modification: refused." in said
    with zipfile.ZipFile(tmp_path / "interplan.zip") as archive:
        (name,) = [one for one in archive.namelist() if one.endswith(".yaml")]
        details = yaml.safe_load(archive.read(name))["modification_details_dictionary"]
    assert set(details) == {scene_token("mill-junction"), scene_token("ferry-road")}
    assert list(details[scene_token("mill-junction")]["special_scenario"]) == ["0", "1"]
    with pytest.raises(CommandError, match=r"Unknown contestant 'nobody'. Known: reference, rule"):
        export("--format", "interplan", "--contestant", "nobody", "--out", "-")
