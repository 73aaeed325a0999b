"""A share is rounded the same wherever it stands: in the table and the panels."""

import pytest

from arena.rating.comparisons import Estimate
from arena.rating.lines import whole_percent
from arena.results.exports.tables import Row
from arena.templatetags.results import estimate_percent, percent


@pytest.mark.parametrize(
    ("share", "shown"),
    [(0.0, 0), (0.005, 0), (0.015, 2), (0.425, 42), (0.575, 58), (0.995, 100), (1.0, 100)],
)
def test_a_half_goes_to_the_even_number(share: float, shown: int) -> None:
    assert whole_percent(share) == shown


def test_table_and_panels_agree() -> None:
    rows = [_row("ann", wins=23), _row("bob", wins=17)]
    assert [row.score_percent for row in rows] == [58, 42]
    assert percent(0.575) == "58 %"
    assert "58 %" in estimate_percent(Estimate(value=0.575, lower=0.425, upper=0.995))


def _row(slug: str, *, wins: int) -> Row:
    return Row(
        name=slug,
        variant="",
        slug=slug,
        kind="rule",
        simulated=False,
        rank=None,
        rating=None,
        lower=None,
        upper=None,
        votes=40,
        wins=wins,
        ties=0,
        losses=40 - wins,
        note="",
    )
