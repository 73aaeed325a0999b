"""Mean driving scores from the command line."""

import csv
from io import StringIO

import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

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
    page = signed_in(people()["researcher"]).get(reverse("job-tab", args=[job.code, "driving"]))
    assert "Planners beside each other" in page.content.decode()
