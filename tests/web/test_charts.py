"""The interval chart's numbers, checked by hand."""

from __future__ import annotations

import itertools

import pytest

from arena.exports.tables import Row
from arena.web.charts import LEFT, RIGHT, interval_chart


def line(name: str, elo: float | None, spread: float = 20.0) -> Row:
    lower, upper = (None, None) if elo is None else (elo - spread, elo + spread)
    return Row(
        name=name, variant="", slug=name.lower(), kind="rule", simulated=False, rank=1,
        rating=elo, lower=lower, upper=upper, votes=3, wins=1, ties=1, losses=1, note="",
    )  # fmt: skip


def test_round_ticks_enclose_every_interval() -> None:
    chart = interval_chart([line("Ann", 1042.0), line("Bob", 958.0)])
    assert chart is not None
    assert [tick.label for tick in chart.ticks] == ["920", "940", "960", "980", "1000", "1020",
                                                    "1040", "1060", "1080"]  # fmt: skip
    assert (chart.ticks[0].x, chart.ticks[-1].x) == (LEFT, RIGHT)


def test_a_rating_stands_where_the_axis_says() -> None:
    chart = interval_chart([line("Ann", 1000.0, spread=50.0)])
    assert chart is not None
    at = {tick.label: tick.x for tick in chart.ticks}
    row = chart.rows[0]
    assert row.x == at["1000"]
    assert row.low_x == pytest.approx((at["940"] + at["960"]) / 2, abs=0.1)
    assert row.high_x == pytest.approx((at["1040"] + at["1060"]) / 2, abs=0.1)


def test_who_has_no_interval_is_left_out_and_nobody_gives_no_chart() -> None:
    chart = interval_chart([line("Ann", 1000.0), line("Bob", None)])
    assert chart is not None
    assert [row.name for row in chart.rows] == ["Ann"]
    assert interval_chart([line("Bob", None)]) is None


def test_rows_do_not_overlap_and_long_names_are_cut() -> None:
    chart = interval_chart([line("A" * 50, 1000.0), line("Bob", 990.0), line("Cid", 980.0)])
    assert chart is not None
    assert all(later.y - row.y > 20 for row, later in itertools.pairwise(chart.rows))
    assert len(chart.rows[0].name) == 26
    assert ("A" * 50) in chart.rows[0].title


def test_a_zero_width_interval_still_has_an_axis() -> None:
    chart = interval_chart([line("Ann", 1000.0, spread=0.0)])
    assert chart is not None
    assert len(chart.ticks) >= 2
