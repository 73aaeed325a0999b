"""The scatter charts' and the heat map's numbers, checked by hand."""

from __future__ import annotations

import math
from itertools import combinations

import pytest

from arena.exports.badges import badge_places
from arena.exports.drawing import SIMULATED
from arena.exports.heat import heat_map
from arena.exports.plots import ELO, VOTES, Given, Plot
from arena.exports.scatter_chart import scatter_chart
from arena.exports.tables import Row
from arena.results.tree import PairRecord
from arena.web.charts import BAR_LEFT, BAR_RIGHT, bars
from arena.web.scatter import BOTTOM, LEFT, NARROW, RADIUS, RIGHT, TOP, scatter


def plot(points: list[Given], **changes: object) -> Plot:
    return Plot(across=VOTES, up=ELO, points=points, **changes)  # type: ignore[arg-type]


def test_points_stand_where_round_marks_say() -> None:
    given = [
        Given(number=1, name="a", x=1.0, y=1000.0),
        Given(number=2, name="b", x=2.0, y=1100.0),
    ]
    chart = scatter(plot(given))
    assert chart is not None
    across = {tick.label: tick.x for tick in chart.across}
    up = {tick.label: tick.x for tick in chart.up}
    assert chart.points[0].x == across["1"]
    assert (chart.points[0].y, chart.points[1].y) == (up["1000"], up["1100"])
    assert (min(across.values()), max(across.values())) == (LEFT, RIGHT)
    assert (min(up.values()), max(up.values())) == (TOP, BOTTOM)


def test_on_a_logarithmic_axis_decades_are_equally_far() -> None:
    given = [Given(number=n, name="x", x=10.0**n, y=float(n)) for n in (1, 2, 3)]
    chart = scatter(plot(given, is_log=True))
    assert chart is not None
    first, second, third = (point.x for point in chart.points)
    assert second - first == pytest.approx(third - second, abs=0.2)
    assert first > LEFT
    assert third < RIGHT


def test_between_two_marks_of_a_logarithmic_axis_every_digit_has_one() -> None:
    given = [Given(number=n, name="x", x=x, y=1.0) for n, x in enumerate((2500.0, 4000.0))]
    chart = scatter(plot(given, is_log=True))
    assert chart is not None
    assert [tick.label for tick in chart.across] == ["2000", "3000", "4000", "5000"]


def test_no_number_covers_another_where_points_lie_on_each_other() -> None:
    given = [Given(number=n, name="x", x=1280.0, y=30.0 + n % 3) for n in range(30)]
    chart = scatter(plot(given, from_zero=True), width=NARROW)
    assert chart is not None
    places = [(point.badge_x, point.badge_y) for point in chart.points]
    gaps = [math.dist(one, other) for one, other in combinations(places, 2)]
    assert min(gaps) >= 2 * RADIUS
    assert all(chart.left <= x <= chart.right and TOP <= y <= BOTTOM for x, y in places)
    assert [point.is_moved for point in chart.points[:1]] == [False]


def test_a_number_stays_on_its_point_where_there_is_room() -> None:
    points = [(10.0, 10.0), (40.0, 10.0), (41.0, 10.0)]
    places = badge_places(points, radius=10.0, box=(0.0, 100.0, 0.0, 100.0))
    assert places[:2] == points[:2]
    assert math.dist(places[2], points[2]) < 25.0


def test_a_single_point_a_curve_and_nothing() -> None:
    given = [Given(number=1, name="a", x=100.0, y=20.0)]
    chart = scatter(plot(given, from_zero=True, falls=200.0))
    assert chart is not None
    assert chart.up[0].label == chart.across[0].label == "0"
    assert chart.curve
    assert all(float(pair.split(",")[1]) >= TOP for pair in chart.curve.split())
    assert scatter(plot([])) is None
    assert scatter(None) is None


def test_bars_share_one_axis_and_stay_on_it() -> None:
    found = bars([("a", 990.0, 1000.0, 1010.0), ("b", None, 1.0, None)], span=(1000.0, 1020.0))
    assert found is not None
    assert set(found.by_key) == {"a"}
    bar = found.by_key["a"]
    assert (bar.low_x, bar.x) == (BAR_LEFT, BAR_LEFT), (
        "what lies before the axis stands at its end"
    )
    assert bar.high_x == pytest.approx((BAR_LEFT + BAR_RIGHT) / 2)
    assert bars([("b", None, None, None)]) is None


def test_the_heat_map_mirrors_scores_and_marks_what_is_few() -> None:
    def row(slug: str) -> Row:
        return Row(
            name=slug, variant="", slug=slug, kind="rule", simulated=False, rank=1, rating=1000.0,
            lower=None, upper=None, votes=1, wins=0, ties=1, losses=0, note="",
        )  # fmt: skip

    pair = PairRecord(a="a", b="b", wins=30, ties=10, losses=0, both_miss=0, planned=50)
    first, second, third = heat_map([pair], [row("a"), row("b"), row("c")])
    cells = (first.cells[1], second.cells[0])
    assert [cell.percent for cell in cells if cell] == [88, 12]
    assert [cell.step for cell in cells if cell] == [10, 0]
    assert first.cells[0] is None
    lonely = third.cells[0]
    assert lonely is not None
    assert (lonely.percent, lonely.votes, lonely.is_few) == (None, 0, True)


@pytest.mark.parametrize("is_simulated", [True, False])
def test_the_key_of_a_file_has_the_colour_of_its_points(is_simulated: bool) -> None:
    given = [
        Given(number=n, name="x", x=x, y=1.0, group="utility", is_simulated=is_simulated)
        for n, x in enumerate((1.0, 2.0), start=1)
    ]
    drawing = scatter_chart(plot(given), file_format="svg").decode()
    assert (SIMULATED in drawing, "#2c7a4b" in drawing) == (is_simulated, not is_simulated)
