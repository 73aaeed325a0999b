"""A job goes out as interPlan's file."""

import zipfile
from io import StringIO
from pathlib import Path

import pytest
import yaml
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.formats.interplan.file import scene_token
from augment.models import Contestant, GenerationJob, Scenario
from augment.services.scenarios.catalogue import load_catalogue
from augment.services.scenarios.scenes import LoadedScenario
from tests.fixtures.shelf import FOLDER
from tests.jobs import rows

pytestmark = pytest.mark.django_db

SLUGS = ("crash-mill-junction", "overtake-mill-junction", "nudge-ferry-road")


@pytest.fixture
def job() -> GenerationJob:
    """Everything of two scenes from the reference, and nothing from a contestant that refused."""
    load_catalogue(folder=FOLDER)
    Scenario.objects.filter(slug__in=SLUGS).update(keep_traffic=False)
    job = GenerationJob.objects.create(name="Round 1")
    reference = rows.add_kind("reference")
    rule = rows.add_kind("rule", Contestant.Kind.RULE)
    for slug in SLUGS:
        scenario = Scenario.objects.get(slug=slug)
        rows.add_answer(job, scenario, reference, LoadedScenario(scenario).reference)
        rows.add_answer(job, scenario, rule)
    return job


def export(*options: str) -> tuple[str, str]:
    out, err = StringIO(), StringIO()
    arguments = ("scenarios", "Round 1", "--format", "interplan", *options)
    call_command("export", *arguments, stdout=out, stderr=err)
    return out.getvalue(), err.getvalue()


def test_a_job_goes_to_a_file(job: GenerationJob, tmp_path: Path) -> None:
    file = tmp_path / "interplan.zip"
    _, said = export("--out", str(file))
    assert "Left out: crash-mill-junction by rule: there is no modification: refused." in said
    with zipfile.ZipFile(file) as archive:
        (name,) = [one for one in archive.namelist() if one.endswith(".yaml")]
        details = yaml.safe_load(archive.read(name))["modification_details_dictionary"]
    assert set(details) == {scene_token("mill-junction"), scene_token("ferry-road")}
    assert list(details[scene_token("mill-junction")]["special_scenario"]) == ["0", "1"]


def test_a_contestant_that_is_none_is_named(job: GenerationJob) -> None:
    with pytest.raises(CommandError, match=r"Unknown contestant 'nobody'. Known: reference, rule"):
        export("--contestant", "nobody", "--out", "-")
