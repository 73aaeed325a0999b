"""The charts of a rating, for pages and as files: intervals, pairs, scenario types, scatters."""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from arena.exports import drawing
from arena.exports.cells import show_name
from arena.models import Snapshot
from arena.rating.lines import whole_percent
from arena.rating.snapshot_document import PairRecord, TypeRating
from arena.results.exports.tables import LeaderboardTable, Row, leaderboard_table
from arena.results.services.analysis import FEW_VOTES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Chart = Callable[..., bytes]
"""Takes `file_format`: "svg", "pdf" or "png"."""

STRONG = 0.3
"""This far from an even score a cell has its full colour."""

LONGEST_NAME = 38

_HEAT = ("#f0a15c", "#f7f8f8", "#6aa5db")
"""Orange for the column, blue for the row: told apart with any colour vision."""

_CLASSES = {"frontier": drawing.MARK, "utility": "#2c7a4b", "open_weight": "#a35a00"}
"""Colours of the classes of models."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A contestant in a scatter chart.

    Attributes:
        key: What it is called in the drawing, as in the table beside it.
        model_class: Whose colour it has, empty without.
    """

    key: str
    row: Row
    x: float
    model_class: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """A chart of Elo against something else.

    Attributes:
        across: What that is.
        is_log: Whether the axis across is logarithmic.
    """

    across: str
    points: Sequence[Point]
    is_log: bool = False


def charts(snapshot: Snapshot) -> Mapping[str, Chart]:
    """Return every chart that a rating has, by name."""
    table, results = leaderboard_table(snapshot), snapshot.results
    by_name: dict[str, Chart] = {"leaderboard": partial(interval_chart, table)}
    if results.pairs:
        by_name["pairs"] = partial(heat_chart, table.rows, results.pairs)
    if results.types:
        by_name["types"] = partial(type_charts, results.types, table.rows)
    scatters = make_scatters(snapshot, table)
    return by_name | {name: partial(scatter_chart, plot) for name, plot in scatters.items()}


def make_scatters(snapshot: Snapshot, table: LeaderboardTable) -> dict[str, Scatter]:
    """Return the scatter charts that have points, by name."""
    far, costs = snapshot.results.displacement, snapshot.results.cost
    classes = {line.slug: line.model_class for line in costs}
    rated = [(key, row) for key, row in key_rows(table) if row.rating is not None]
    plots = {}
    for name, across, values in (
        ("wish", "Median distance to the wish (m)", {x.slug: x.wish_median_m for x in far}),
        ("displacement", "Median displacement (m)", {x.slug: x.median_m for x in far}),
        ("elo-usd", "USD per scenario", {x.slug: x.usd or None for x in costs}),
    ):
        is_money = name == "elo-usd"
        points = [
            Point(key=key, row=row, x=x, model_class=classes[row.slug] if is_money else "")
            for key, row in rated
            if (x := values.get(row.slug)) is not None
        ]
        if points:
            plots[name] = Scatter(across=across, points=points, is_log=is_money)
    return plots


def key_rows(table: LeaderboardTable) -> list[tuple[str, Row]]:
    """Return rows with letters of their own, which nobody takes for ranks: A to Z, A1 to Z1."""
    letters, many = string.ascii_uppercase, len(string.ascii_uppercase)
    return [(f"{letters[n % many]}{n // many or ''}", row) for n, row in enumerate(table.rows)]


def interval_chart(table: LeaderboardTable, *, file_format: str) -> bytes:
    """Draw the ratings of a table, and say below what kind of intervals these are."""
    has_intervals = any(row.has_bound for row in table.rows)
    label = "Elo with 95 % intervals" if has_intervals else "Elo, without intervals"
    words = [*table.snapshot.marks, *["only within groups comparable"] * table.has_parts]
    label += f" ({', '.join(words)})" if words else ""
    return rows_chart(table.rows, label, file_format=file_format)


@drawing.draw_once
def rows_chart(rows: Sequence[Row], label: str, *, file_format: str) -> bytes:
    """Draw ratings as dots with their intervals as bars, best on top; diamonds are simulated."""
    from matplotlib.figure import Figure

    with drawing.chart_style():
        figure = Figure(figsize=(6.4, 1.1 + 0.34 * len(rows)), layout="constrained")
        axes = figure.add_subplot()
        _draw_intervals(axes, rows, {row.slug: row.interval for row in rows})
        _name_ranked(axes, rows)
        axes.set_xlabel(label)
        return drawing.write_figure(figure, file_format)


@drawing.draw_once
def type_charts(parts: Sequence[TypeRating], rows: Sequence[Row], *, file_format: str) -> bytes:
    """Draw a panel for each scenario type, contestants in the order of the whole table."""
    from matplotlib.figure import Figure

    across = min(len(parts), 3)
    down = math.ceil(len(parts) / across)
    with drawing.chart_style():
        size = (2.4 + 2.1 * across, 0.5 + (0.7 + 0.26 * len(rows)) * down)
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for panel, part in zip(grid.flat, parts, strict=False):
            intervals = {line.slug: (line.lower, line.rating, line.upper) for line in part.lines}
            _draw_intervals(panel, rows, intervals)
            drawing.name_lines(
                panel, [show_name(row) for row in rows], [row.is_simulated for row in rows]
            )
            _note_ranks(panel, rows, part)
            panel.set_title(f"{part.label} (n {part.votes - (part.settled or 0)})", fontsize=7)
            panel.tick_params(axis="x", labelbottom=True)
        for panel in grid.flat[len(parts) :]:
            panel.set_visible(False)
        text = "Elo with 95 % intervals, each type rated by itself;"
        text += f" ranks at the right, * with fewer than {FEW_VOTES} votes"
        figure.supxlabel(text, fontsize=8)
        return drawing.write_figure(figure, file_format)


@drawing.draw_once
def heat_chart(rows: Sequence[Row], pairs: Sequence[PairRecord], *, file_format: str) -> bytes:
    """Draw percent and number of votes in every cell, contestants in the given order."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    place = {row.slug: n for n, row in enumerate(rows)}
    scores, votes = np.zeros((2, len(rows), len(rows)))
    for pair in pairs:
        a, b = place[pair.a], place[pair.b]
        won = pair.wins + pair.ties / 2
        scores[a, b], scores[b, a] = won, pair.votes - won
        votes[a, b] = votes[b, a] = pair.votes
    shares = np.divide(scores, votes, out=np.full_like(scores, np.nan), where=votes > 0)
    with drawing.chart_style():
        side_in = 0.62 * max(len(rows), 2)
        names_in = 0.6 + 0.08 * max((len(show_name(row)) for row in rows), default=0)
        figure = Figure(figsize=(side_in + names_in, side_in + 0.9), layout="constrained")
        axes = figure.add_subplot()
        colours = LinearSegmentedColormap.from_list("score", _HEAT)
        axes.imshow(shares, cmap=colours, vmin=0.5 - STRONG, vmax=0.5 + STRONG)
        axes.set_anchor("E")  # what is left of the width is for the names
        for a, b in zip(*map(list, np.nonzero(votes)), strict=True):
            text = f"{whole_percent(shares[a, b])}\n{votes[a, b]:.0f}"
            axes.text(b, a, text, ha="center", va="center")
        _name_ranked(axes, rows)
        axes.grid(visible=False)
        axes.set_xticks(range(len(rows)), [str(row.rank or "–") for row in rows])
        axes.set_xlabel(
            "Columns in the order of the rows. Score\nof the row in percent, a tie half a win;\n"
            "votes beneath"
        )
        return drawing.write_figure(figure, file_format)


@drawing.draw_once
def scatter_chart(plot: Scatter, *, file_format: str) -> bytes:
    """Draw points with letters and intervals, and beside them what the letters stand for."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator

    with drawing.chart_style():
        height = max(3.6, 0.2 * (len(plot.points) + 4))
        figure = Figure(figsize=(7.2, height), layout="constrained")
        axes = figure.add_subplot()
        if plot.is_log:
            # 1, 2 and 5 of every decade, as plain numbers.
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.minorticks_off()
        for point in plot.points:
            _draw_point(axes, point)
        axes.grid()
        axes.set_xlabel(plot.across)
        axes.set_ylabel("Elo with 95 % interval")
        legend = figure.legend(loc="outside right upper", frameon=False, fontsize=7)
        for text, point in zip(legend.get_texts(), plot.points, strict=True):
            text.set_color(drawing.SIMULATED if point.row.is_simulated else drawing.INK)
        return drawing.write_figure(figure, file_format)


# --- Private -----------------------------------------------------------------------------------


def _draw_intervals(
    axes: Axes, rows: Sequence[Row], intervals: Mapping[str, drawing.Interval]
) -> None:
    for place, row in enumerate(rows):
        if row.slug in intervals:
            drawing.draw_interval(axes, place, intervals[row.slug], simulated=row.is_simulated)


def _name_ranked(axes: Axes, rows: Sequence[Row]) -> None:
    """Name the lines of a chart, each with its rank."""
    names = [f"{show_name(row)}  {row.rank or '–'}" for row in rows]
    drawing.name_lines(axes, names, [row.is_simulated for row in rows])
    edge = (0, 1), (-2, 2), "axes fraction", "offset points"
    axes.annotate("Rank", *edge, ha="right", color=drawing.SOFT)


def _note_ranks(axes: Axes, rows: Sequence[Row], part: TypeRating) -> None:
    """Write ranks beside the lines of a panel, with a star where there are few votes."""
    place = {row.slug: n for n, row in enumerate(rows)}
    for line in part.lines:
        if line.votes:
            text = f"{line.rank or '–'}{'*' if line.few else ''}"
            at, across = (1, place[line.slug]), ("axes fraction", "data")
            axes.annotate(text, at, (3, 0), across, "offset points", va="center", fontsize=7)


def _draw_point(axes: Axes, point: Point) -> None:
    row, kind = point.row, point.model_class.replace("_", " ")
    name = show_name(row)
    name = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
    drawing.draw_interval(
        axes,
        point.x,
        point.row.interval,
        simulated=row.is_simulated,
        colour=_CLASSES.get(point.model_class, drawing.MARK),
        upright=True,
        label=f"{point.key}  {name}, rank {row.rank or '–'}" + (f" ({kind})" if kind else ""),
    )
    place = (point.x, row.rating or 0.0)
    axes.annotate(point.key, place, (4, 4), textcoords="offset points")
