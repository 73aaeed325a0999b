"""Axes, numbers of points and the heat map, checked by hand."""

import math
from itertools import combinations

import pytest

from arena.rating.snapshot_document import PairRecord
from arena.results.exports.charts import heat_map
from arena.results.exports.drawing import SIMULATED, interval_ticks
from arena.results.exports.plots import (
    ELO,
    VOTES,
    Plot,
    Point,
    axis_ticks,
    badge_places,
    scatter_chart,
)
from arena.results.exports.tables import Row


def plot(points: list[Point], **changes: object) -> Plot:
    return Plot(across=VOTES, up=ELO, points=points, **changes)  # type: ignore[arg-type]


def test_between_two_marks_of_a_logarithmic_axis_every_digit_has_one() -> None:
    given = [Point(number=n, name="x", x=x, y=1.0) for n, x in enumerate((2500.0, 4000.0))]
    across, _ = axis_ticks(plot(given, is_log=True))
    assert [f"{mark:g}" for mark in across] == ["2000", "3000", "4000", "5000"]


def test_no_number_covers_another_where_points_lie_on_each_other() -> None:
    points = [(270.0, 200.0 + n % 3) for n in range(30)]
    places = badge_places(points, radius=10.0, size=(500.0, 340.0))
    gaps = [math.dist(place, other) for place, other in combinations(places, 2)]
    assert min(gaps) >= 20.0
    assert all(0.0 <= x <= 500.0 and 0.0 <= y <= 340.0 for x, y in places)


def test_axes_of_what_falls_with_votes_begin_at_zero() -> None:
    across, up = axis_ticks(plot([Point(number=1, name="a", x=100.0, y=20.0)], from_zero=True))
    assert across[0] == up[0] == 0.0


def test_round_marks_enclose_every_interval() -> None:
    found = interval_ticks([(1022.0, 1042.0, 1062.0), (938.0, 958.0, 978.0)])
    assert found == [920, 940, 960, 980, 1000, 1020, 1040, 1060, 1080]
    assert len(interval_ticks([(1000.0, 1000.0, 1000.0)])) >= 2
    assert interval_ticks([(None, 1000.0, None)]) == []


def test_a_number_stays_on_its_point_where_there_is_room() -> None:
    points = [(10.0, 10.0), (40.0, 10.0), (41.0, 10.0)]
    places = badge_places(points, radius=10.0, size=(100.0, 100.0))
    assert places[:2] == points[:2]
    assert math.dist(places[2], points[2]) < 25.0


def test_the_heat_map_mirrors_scores_and_marks_what_is_few() -> None:
    def row(slug: str) -> Row:
        return Row(
            name=slug,
            variant="",
            slug=slug,
            kind="rule",
            simulated=False,
            rank=1,
            rating=1000.0,
            lower=None,
            upper=None,
            votes=1,
            wins=0,
            ties=1,
            losses=0,
            note="",
        )

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
        Point(number=n, name="x", x=x, y=1.0, group="utility", is_simulated=is_simulated)
        for n, x in enumerate((1.0, 2.0), start=1)
    ]
    drawing = scatter_chart(plot(given), file_format="svg").decode()
    assert (SIMULATED in drawing, "#2c7a4b" in drawing) == (is_simulated, not is_simulated)
