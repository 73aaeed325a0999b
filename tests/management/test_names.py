"""Names that nobody knows are refused before anything is counted or run."""

from __future__ import annotations

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from tests.jobs import rows

pytestmark = pytest.mark.django_db


@pytest.mark.parametrize(
    ("contestants", "scenarios", "fault"),
    [
        ("ghost", "all", "Unknown contestant 'ghost'"),
        ("all", "ghost", "Unknown scenario 'ghost'"),
        ("all", "ghost-*", r"Unknown scenario 'ghost-\*'"),
        ("all", "set:soft", "Unknown set 'soft'"),
    ],
)
def test_an_estimate_of_unknown_names_is_refused(
    contestants: str, scenarios: str, fault: str
) -> None:
    rows.launch()
    with pytest.raises(CommandError, match=fault):
        call_command(
            "generate", "--estimate", "--contestants", contestants, "--scenarios", scenarios
        )
