"""Every chart of a rating as a file: the same twice, complete, and for staff alone."""

import re
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import product
from typing import Any

import pytest
from django.urls import reverse

from arena import tasks
from arena.exports.drawing import INK, SIMULATED, recolour, write_figure
from arena.models import Snapshot
from arena.rating.snapshot_document import (
    DisplacementSummary,
    PairRecord,
    ScenarioCost,
    TypeRating,
    TypeStanding,
)
from arena.results.exports.charts import (
    Chart,
    Point,
    Scatter,
    charts,
    heat_chart,
    interval_chart,
    rows_chart,
    scatter_chart,
    type_charts,
)
from arena.results.exports.tables import Row, leaderboard_table
from arena.results.exports.writers import CHARTS
from arena.results.services.ratings import rate_now as rate
from arena.shell import sending
from tests.full_study import Size, full_study
from tests.results.old import OLD, stored
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

SMALL = Size(scenarios=5, experts=3, votes_per_expert=60)
THREADS = 4
BEGINS = {"svg": b"<?xml", "pdf": b"%PDF-", "png": b"\x89PNG"}


@pytest.fixture
def snapshot() -> Snapshot:
    """With costs and displacements as language models would have them."""
    made = rate(study=full_study(size=SMALL), rounds=100, unit="vote", seed=4)
    classes = ("frontier", "utility", "open_weight", "")
    known: dict[str, Any] = {"model": "m", "augmentations": 5, "calls": 1.0}
    measured: dict[str, Any] = {
        **{"median_m": 0.5, "mean_m": 1.0, "n": 5, "missing": 0, "surplus": 0},
        **{"augmentations": 5, "wish_median_m": 0.25, "wish_mean_m": 0.5},
    }
    cost, displacement = [], []
    for n, line in enumerate(made.standings.order_by("slug")):
        priced = {"tokens": 3000.0 + n, "usd": 0.001 * (n + 1), "model_class": classes[n % 4]}
        cost.append(ScenarioCost(slug=line.slug, **known | priced))
        displacement.append(DisplacementSummary(slug=line.slug, **measured))
    made.results = replace(made.results, cost=tuple(cost), displacement=tuple(displacement))
    made.save()
    return made


@pytest.mark.slow
@pytest.mark.usefixtures("drawn_anew")
def test_the_displacement_chart_comes_in_every_format_the_same_twice(snapshot: Snapshot) -> None:
    """The others are drawn twice for the zip of everything (test_bundle.py)."""
    drawn, again = charts(snapshot), charts(Snapshot.objects.get(pk=snapshot.pk))
    assert tuple(drawn) == tuple(again) == ("leaderboard", *CHARTS)
    for form, begins in BEGINS.items():
        content = drawn["displacement"](file_format=form)
        assert content.startswith(begins), form
        assert (content == again["displacement"](file_format=form)) is True


def a_row(slug: str, *, simulated: bool = False) -> Row:
    return Row(name=slug, slug=slug, kind="rule", is_simulated=simulated, rating=1000.0)


PAIR = PairRecord(a="a", b="b", wins=30, ties=10, losses=0, both_miss=0, planned=50)


def test_the_heat_map_mirrors_scores_and_says_nothing_without_votes() -> None:
    drawing = heat_chart([a_row(one) for one in "abc"], [PAIR], file_format="svg").decode()
    assert [drawing.count(f">{cell}<") for cell in ("88", "12", "40")] == [1, 1, 2]


@pytest.mark.parametrize("simulated", [True, False])
def test_the_key_of_a_file_has_the_colour_of_its_points(simulated: bool) -> None:
    row = a_row("x", simulated=simulated)
    points = [
        Point(key=key, row=row, x=x, model_class="utility") for key, x in (("A", 1.0), ("B", 2.0))
    ]
    drawing = scatter_chart(Scatter(across="Votes", points=points), file_format="svg").decode()
    assert (SIMULATED in drawing, "#2c7a4b" in drawing) == (simulated, not simulated)


def write_quickly(figure: Any, file_format: str) -> bytes:
    """Draw lines, which is quick, and of other formats the beginning."""
    is_quick = file_format == "svg"
    return write_figure(figure, file_format) if is_quick else BEGINS[file_format]


@pytest.mark.slow
def test_a_worker_draws_the_charts_and_pages_only_read_them(
    snapshot: Snapshot, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert tasks is not None  # registers what a worker draws
    monkeypatch.setattr("arena.exports.drawing.write_figure", write_quickly)
    draw, what = sending.send_charts.args  # the message
    draw(what, snapshot.pk)
    monkeypatch.setattr("arena.exports.drawing.write_figure", None)
    reader = signed_in(people()["researcher"])
    for name, form in product(("leaderboard", *CHARTS), BEGINS):
        address = reverse("results-export", args=[snapshot.study.code, name, form])
        assert reader.get(address).content.startswith(BEGINS[form]), (name, form)
    Snapshot.objects.filter(pk=snapshot.pk).update(is_early=True)  # which a chart says
    with pytest.raises(TypeError):
        reader.get(reverse("results-export", args=[snapshot.study.code, "leaderboard", "svg"]))


def test_charts_have_the_ranks_of_the_table_and_the_star_of_the_page() -> None:
    """Two of three share the first rank; of one there are few votes, in one type."""
    rows = [replace(a_row(slug), rank=rank) for slug, rank in (("a", 1), ("b", 1), ("c", 3))]
    no_interval: dict[str, Any] = {"rating": 1000.0, "lower": None, "upper": None}
    lines = tuple(
        TypeStanding(slug=row.slug, rank=row.rank, votes=votes, few=votes < 30, **no_interval)
        for row, votes in zip(rows, (30, 29, 0), strict=True)
    )
    part = TypeRating(type="t", label="T", votes=59, scenarios=1, status="", lines=lines)

    def texts(chart: Chart, *given: Any) -> list[str]:
        return re.findall(r">([^<]+)</text>", chart(*given, file_format="svg").decode())

    for drawn in (texts(rows_chart, rows, "Elo"), texts(heat_chart, rows, [PAIR])):
        assert {"a  1", "b  1", "c  3"} < set(drawn)
    assert texts(heat_chart, rows, [PAIR])[:3] == ["1", "1", "3"], "columns"
    assert {"1", "1*"} < set(texts(type_charts, [part], rows))
    assert "3" not in texts(type_charts, [part], rows), "nobody voted"


@pytest.mark.usefixtures("drawn_anew")
def test_charts_that_are_drawn_at_once_are_those_that_are_drawn_alone() -> None:
    # Whoever reads rows in a thread of its own needs another connection than this test's.
    table = leaderboard_table(stored(OLD["snapshot"]["results"]))
    table = replace(table, rows=(*table.rows, replace(a_row("unrated"), rating=None)))
    alone = interval_chart(table, file_format="svg")
    assert b">unrated" in alone
    together = threading.Barrier(THREADS)

    def draw(_: int) -> bytes:
        together.wait()
        return interval_chart(table, file_format="svg")

    with ThreadPoolExecutor(THREADS) as pool:
        assert all(drawn == alone for drawn in pool.map(draw, range(THREADS)))


def test_a_chart_on_a_page_has_the_colours_of_its_theme() -> None:
    ground = '<path style="fill: #ffffff"/>'
    drawn = f'<svg width="9">{ground}<text style="fill: {INK}">A</text></svg>'.encode()
    shown = recolour(drawn).decode()
    assert shown.startswith('<svg width="9"><style>')
    assert '<path style="fill: none"/>' in shown
    assert "--ink: light-dark(" in shown
    assert '<text style="fill: var(--ink)">A</text></svg>' in shown
