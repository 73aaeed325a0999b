"""Mean driving scores from the command line."""

import csv
from io import StringIO

import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

from augment.models import Simulation
from tests.drives import driven, finished
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def exported(*arguments: str) -> str:
    out = StringIO()
    call_command("export", "driving", "Round 1", "--out", "-", *arguments, stdout=out)
    return out.getvalue()


def test_the_table_of_a_job_is_written_the_same_twice() -> None:
    driven(finished(rows.launch()))
    first = exported("--format", "json")
    assert '"lowered_percent": 75.0' in first
    assert exported("--format", "json") == first
    assert exported().splitlines()[1].startswith("Unmodified scene,,,,no,100.00,100.00,0.00,1,0")


def test_planners_of_a_job_stand_in_one_table() -> None:
    scores = {"pdm-closed": 1.0, "idm": 0.5}
    job = finished(rows.launch(scenarios=8))
    for planner, score in scores.items():
        driven(job, planner=planner, before=1.0, after=score)
    with pytest.raises(CommandError, match="planner that drove the job"):
        exported("--planners", "pdm-closed", "pdm-closed:original")
    lines = list(csv.DictReader(exported("--planners", *scores).splitlines()))
    found = {(line["scenarios"], line["planner"], line["against"]): line for line in lines}
    mean = found["reference", "idm", ""]
    assert (mean["mean_percent"], mean["drives"], mean["sets"]) == ("50", "8", "b")
    difference = found["reference", "pdm-closed, paper", "idm"]
    assert (difference["mean_percent"], difference["p_holm"]) == ("50", "0")
    assert found["Unmodified scene", "idm", ""]["sets"] == "a"
    tex = exported("--planners", *scores, "--format", "latex")
    assert r"50.0 [17.9, 82.1] b" in tex
    researcher = signed_in(people()["researcher"])
    page = researcher.get(reverse("job-tab", args=[job.code, "driving"]))
    assert "Planners beside each other" in page.content.decode()


def test_a_table_of_planners_that_are_not_there_is_refused_in_a_sentence() -> None:
    job = finished(rows.launch())
    driven(job)
    table = reverse("job-export", args=[job.code, "planners-nuplan", "csv"])
    page = signed_in(people()["researcher"]).get(table, follow=True)
    assert "was not driven by two planners" in page.content.decode()


def test_who_is_better_on_the_same_drives_comes_first_where_some_are_missing() -> None:
    job = finished(rows.launch(scenarios=10))
    for row in driven(job, before=0.9, after=0.9)[-3:]:
        Simulation.objects.filter(pk=row.pk).update(nuplan_score=0.1)
    unfinished = driven(job, planner="idm", offsets="original", before=0.9, after=0.8)[-3:]
    Simulation.objects.filter(pk__in=[row.pk for row in unfinished]).update(state="failed")
    text = exported("--planners", "pdm-closed", "idm", "--format", "latex")
    # Of 0.8 seven times no spread is left but of rounding; offsets are PDM-Closed's alone.
    assert r"reference & 7 to 10 & 66.0 [37.7, 86.2] a & 80.0 [35.7, 96.6] b\\" in text
    assert "Not all planners finished the same drives" in text
