"""The charts of a rating, for pages and as files; the same rating always gives the same bytes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Protocol

from arena.exports.charts.heat import heat_chart
from arena.exports.charts.intervals import interval_chart
from arena.exports.charts.plots import plots
from arena.exports.charts.scatter import scatter_chart
from arena.exports.charts.types import type_charts
from arena.exports.tables import leaderboard_table
from arena.models import Snapshot
from augment.errors import UnknownName

CONTENT_TYPES = {"svg": "image/svg+xml", "pdf": "application/pdf", "png": "image/png"}


class Chart(Protocol):
    """A chart that can be drawn."""

    def __call__(self, *, file_format: str) -> bytes:
        """The bytes of an "svg", "pdf" or "png" file."""


def charts(snapshot: Snapshot) -> Mapping[str, Chart]:
    """Every chart that a rating has, by name."""
    table = leaderboard_table(snapshot)
    by_name: dict[str, Chart] = {"leaderboard": partial(interval_chart, table)}
    if snapshot.results.pairs:
        by_name["pairs"] = partial(heat_chart, table.rows, snapshot.results.pairs)
    if snapshot.results.types:
        by_name["types"] = partial(type_charts, snapshot.results.types, table)
    for name, plot in plots(snapshot, table).items():
        by_name[name] = partial(scatter_chart, plot)
    return by_name


def chart_bytes(snapshot: Snapshot, *, name: str, file_format: str) -> bytes:
    """A chart of a rating as a file.

    Raises:
        UnknownName: The rating has no such chart, or there is no such format.
    """
    if file_format not in CONTENT_TYPES:
        raise UnknownName("format", file_format, list(CONTENT_TYPES))
    known = charts(snapshot)
    if name not in known:
        raise UnknownName("chart of this rating", name, list(known))
    return known[name](file_format=file_format)
