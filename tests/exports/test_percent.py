"""A share is rounded the same wherever it stands: in the table and the panels."""

import pytest

from arena.rating.comparisons import Estimate
from arena.rating.lines import whole_percent
from arena.templatetags.results import estimate, percent


@pytest.mark.parametrize(
    ("share", "shown"),
    [(0.0, 0), (0.005, 0), (0.015, 2), (0.425, 42), (0.575, 58), (0.995, 100), (1.0, 100)],
)
def test_a_half_goes_to_the_even_number(share: float, shown: int) -> None:
    assert whole_percent(share) == shown


def test_pages_print_it_so() -> None:
    assert percent(0.575) == "58 %"
    assert "58 %" in estimate(Estimate(value=0.575, lower=0.425, upper=0.995), "percent")
