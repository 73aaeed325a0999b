"""Mean driving scores from the command line."""

from __future__ import annotations

from io import StringIO

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from tests.drives import driven, finished
from tests.jobs import rows

pytestmark = pytest.mark.django_db


def exported(*arguments: str) -> str:
    out = StringIO()
    call_command("export", "driving", "Round 1", "--out", "-", *arguments, stdout=out)
    return out.getvalue()


def test_the_table_of_a_job_is_written_the_same_twice() -> None:
    driven(finished(rows.launch()))
    first = exported("--format", "json")
    assert '"lowered": 0.75' in first
    assert exported("--format", "json") == first
    assert exported().splitlines()[1].startswith("Unmodified scene,,,,no,100.00,100.00,0.00,1,0")


@pytest.mark.parametrize("form", ["csv", "json", "latex"])
def test_the_papers_rows_come_on_request_alone(form: str) -> None:
    driven(finished(rows.launch()))
    assert "reported in the paper" not in exported("--format", form)
    assert "reported in the paper" in exported("--format", form, "--with-paper")


def test_the_printed_table_says_n_and_whose_simulator_it_was() -> None:
    driven(finished(rows.launch()))
    text = exported("--format", "latex")
    assert r"\textbf{n}" in text
    assert "Unmodified scene & 1 & 100.0" in text
    assert r"in Scenario Arena's own simulator; n: drives.}" in text


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--planner", "idm"], "was not driven so"),
        (["--score", "carla"], "carla"),
        (["--format", "xml"], "xml"),
    ],
)
def test_what_is_not_there_is_refused(arguments: list[str], sentence: str) -> None:
    driven(finished(rows.launch()))
    with pytest.raises(CommandError, match=sentence):
        exported(*arguments)
