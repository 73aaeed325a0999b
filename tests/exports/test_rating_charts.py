"""Every chart of a rating as a file: the same twice, complete, and for staff alone."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from arena.models import Snapshot
from arena.rating.snapshot_document import DisplacementSummary, ScenarioCost
from arena.results.exports.charts import chart_bytes, charts, interval_chart
from arena.results.exports.tables import leaderboard_table
from arena.results.services.ratings import rate_now as rate
from tests.full_study import Size, full_study

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
            slug=slug,
            model="m",
            model_class=classes[n % 4],
            augmentations=5,
            calls=1.0,
            tokens=3000.0 + n,
            usd=0.001 * (n + 1),
        )
        for n, slug in enumerate(slugs)
    )
    far = DisplacementSummary(
        slug="", median_m=0.5, mean_m=1.0, n=5, missing=0, surplus=0, augmentations=5
    )
    displacement = (replace(far, slug=slug) for slug in slugs)
    made.results = replace(made.results, cost=tuple(cost), displacement=tuple(displacement))
    made.save()
    return made


def test_every_chart_comes_in_every_format_the_same_twice(snapshot: Snapshot) -> None:
    """Those that the zip of everything has are drawn twice for its test (test_bundle.py)."""
    names = ["leaderboard", "pairs", "types", "width", "displacement"]
    names += ["elo-usd", "displacement-usd", "elo-tokens", "displacement-tokens"]
    assert list(charts(snapshot)) == names
    again = Snapshot.objects.get(pk=snapshot.pk)
    for name in names:
        for form in BEGINS if name == "displacement" else ("svg",):
            content = chart_bytes(snapshot, name=name, file_format=form)
            assert content.startswith(BEGINS[form]), (name, form)
            if name == "displacement":
                assert (content == chart_bytes(again, name=name, file_format=form)) is True


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
