"""Mean driving scores from the command line."""

from io import StringIO

import pytest
from django.core.management import call_command

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
    assert '"lowered_percent": 75.0' in first
    assert exported("--format", "json") == first
    assert exported().splitlines()[1].startswith("Unmodified scene,,,,no,100.00,100.00,0.00,1,0")
