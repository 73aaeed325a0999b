"""Every chart of a rating as a file: the same twice, complete, and for staff alone."""

from __future__ import annotations

import threading
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

from arena.exports.charts import interval_chart
from arena.exports.rating_charts import CONTENT_TYPES, chart_bytes, charts
from arena.exports.tables import leaderboard_table
from arena.models import Snapshot
from arena.results.tree import DisplacementSummary, ScenarioCost
from arena.services.ratings import rate
from arena.web import charts as charts_of_page
from augment.errors import UnknownName
from tests.full_study import Size, full_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

SMALL = Size(scenarios=5, experts=3, votes_per_expert=60)
THREADS = 4
BEGINS = {"svg": b"<?xml", "pdf": b"%PDF-", "png": b"\x89PNG"}


@pytest.fixture
def snapshot() -> Snapshot:
    """With costs and displacements as language models would have them."""
    made = rate(study=full_study(size=SMALL), rounds=300, unit="vote", seed=4)
    classes = ("frontier", "utility", "open_weight", "")
    slugs = [line.slug for line in made.standings.order_by("slug")]
    cost = (
        ScenarioCost(
            slug=slug, model="m", model_class=classes[n % 4], augmentations=5, calls=1.0,
            tokens=3000.0 + n, usd=0.001 * (n + 1),
        )
        for n, slug in enumerate(slugs)
    )  # fmt: skip
    far = DisplacementSummary(
        slug="", median_m=0.5, mean_m=1.0, n=5, missing=0, surplus=0, augmentations=5
    )
    displacement = (replace(far, slug=slug) for slug in slugs)
    made.results = replace(made.results, cost=tuple(cost), displacement=tuple(displacement))
    made.save()
    return made


def words_of(svg: bytes) -> str:
    return " ".join("".join(one.itertext()) for one in ET.fromstring(svg).iter() if one.text)


def test_every_chart_comes_in_every_format_the_same_twice(snapshot: Snapshot) -> None:
    """Those that the zip of everything has are drawn twice for its test (test_bundle.py)."""
    names = ["pairs", "types", "width", "displacement"]
    names += ["elo-usd", "displacement-usd", "elo-tokens", "displacement-tokens"]
    assert list(charts(snapshot)) == names
    again = Snapshot.objects.get(pk=snapshot.pk)
    for name in names:
        for form, begin in BEGINS.items():
            content = chart_bytes(snapshot, name=name, file_format=form)
            assert content.startswith(begin), (name, form)
            if name in ("displacement", "elo-usd"):
                assert (content == chart_bytes(again, name=name, file_format=form)) is True


def test_charts_say_what_their_axes_are_and_who_is_in_them(snapshot: Snapshot) -> None:
    table = leaderboard_table(snapshot)
    said = {
        "types": "each type rated by itself",
        "width": "Half-width of the interval (Elo)",
        "displacement": "Median displacement (m)",
        "elo-usd": "USD per scenario",
        "displacement-tokens": "Tokens per scenario",
    }
    for name, label in said.items():
        words = words_of(chart_bytes(snapshot, name=name, file_format="svg"))
        assert label in words
        assert [row.model for row in table.rows if row.model not in words] == []
    row = replace(table.rows[0], lower=950.0, elo=1000.0, upper=1050.0)
    on_page = charts_of_page.interval_chart([row])
    assert on_page is not None
    in_file = words_of(interval_chart(replace(table, rows=(row,)), file_format="svg")).split()
    assert [tick.label for tick in on_page.ticks if tick.label not in in_file] == []


def test_what_is_simulated_is_called_so_in_every_chart(snapshot: Snapshot) -> None:
    line = snapshot.standings.get(slug="interplan")
    line.is_simulated = True
    line.save()
    for name in charts(snapshot):
        words = words_of(chart_bytes(snapshot, name=name, file_format="svg"))
        assert "interPlan (simulated)" in words, name


def test_a_rating_without_costs_has_no_charts_of_them(snapshot: Snapshot) -> None:
    snapshot.results = replace(snapshot.results, cost=(), displacement=())
    assert list(charts(snapshot)) == ["pairs", "types", "width"]
    with pytest.raises(UnknownName, match="'elo-usd'"):
        chart_bytes(snapshot, name="elo-usd", file_format="svg")
    with pytest.raises(UnknownName, match="'gif'"):
        chart_bytes(snapshot, name="pairs", file_format="gif")


def test_the_page_and_the_command_give_the_same_bytes_to_staff(
    snapshot: Snapshot, tmp_path: Path
) -> None:
    who = people()
    for form, content_type in CONTENT_TYPES.items():
        url = reverse("results-chart", args=[snapshot.study.code, "elo-usd", form])
        answer = signed_in(who["analyst"]).get(url)
        assert (answer.status_code, answer["Content-Type"]) == (200, content_type)
        out = tmp_path / f"chart.{form}"
        asked = ("export", "chart", snapshot.study.name, "--chart", "elo-usd", "--format", form)
        call_command(*asked, "--out", str(out))
        assert (answer.content == out.read_bytes()) is True
    assert signed_in(who["expert"]).get(url).status_code == 403
    nothing = reverse("results-chart", args=[snapshot.study.code, "nothing", "svg"])
    assert signed_in(who["analyst"]).get(nothing).status_code == 404
    with pytest.raises(CommandError, match=r"'nothing'\. Known: pairs"):
        call_command("export", "chart", snapshot.study.name, "--chart", "nothing", "--out", "-")


def test_charts_that_are_drawn_at_once_are_those_that_are_drawn_alone(snapshot: Snapshot) -> None:
    # Whoever reads rows in a thread of its own needs another connection than this test's.
    table = leaderboard_table(snapshot)
    alone = interval_chart(table, file_format="svg")
    together = threading.Barrier(THREADS)

    def draw(_: int) -> list[bytes]:
        together.wait()
        return [interval_chart(table, file_format="svg") for _ in range(2)]

    with ThreadPoolExecutor(THREADS) as pool:
        drawn = [one for several in pool.map(draw, range(THREADS)) for one in several]
    assert all(one == alone for one in drawn)
