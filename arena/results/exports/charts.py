"""The charts of a rating, for pages and as files: intervals, pairs, scenario types, scatters."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from arena.models import Snapshot
from arena.rating.lines import whole_percent
from arena.rating.snapshot_document import PairRecord, TypeRating
from arena.results.exports.drawing import (
    INK,
    SIMULATED,
    SOFT,
    draw_interval,
    house_style,
    interval_ticks,
    name_rows,
    names_width_in,
    rating_axis,
    write_figure,
)
from arena.results.exports.plots import plots, scatter_chart
from arena.results.exports.tables import LeaderboardTable, Row, leaderboard_table
from augment.errors import UnknownName

CONTENT_TYPES = {"svg": "image/svg+xml", "pdf": "application/pdf", "png": "image/png"}

Chart = Callable[..., bytes]
"""Takes `file_format`: "svg", "pdf" or "png"."""

STRONG = 0.3
"""This far from an even score a cell has its full colour."""

STEPS, FEW = 10, 30

_COLOURS = ("#f0a15c", "#f7f8f8", "#6aa5db")
"""Orange for the column, blue for the row: told apart with any colour vision."""


def charts(snapshot: Snapshot) -> Mapping[str, Chart]:
    """Every chart that a rating has, by name."""
    table, results = leaderboard_table(snapshot), snapshot.results
    by_name: dict[str, Chart] = {"leaderboard": partial(interval_chart, table)}
    if results.pairs:
        by_name["pairs"] = partial(heat_chart, table.rows, results.pairs)
    if results.types:
        by_name["types"] = partial(type_charts, results.types, table.rows)
    scatters = plots(snapshot, table)
    return by_name | {name: partial(scatter_chart, plot) for name, plot in scatters.items()}


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


def interval_chart(table: LeaderboardTable, *, file_format: str) -> bytes:
    """Ratings as dots with their intervals as bars, best on top; diamonds are simulated."""
    from matplotlib.figure import Figure

    rows = table.rows
    with house_style():
        figure = Figure(figsize=(6.4, 1.1 + 0.34 * len(rows)), layout="constrained")
        axes = figure.add_subplot()
        for place, row in enumerate(rows):
            draw_interval(axes, place, row.interval, simulated=row.simulated)
        name_rows(axes, rows)
        axes.set_xlabel(_interval_label(table), color=INK)
        rating_axis(axes, len(rows))
        ratings = [row.rating for row in rows if row.rating is not None]
        if ticks := interval_ticks((row.interval for row in rows), ratings):
            axes.set_xlim(ticks[0], ticks[-1])
            axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        return write_figure(figure, file_format)


def type_charts(parts: Sequence[TypeRating], rows: Sequence[Row], *, file_format: str) -> bytes:
    """A panel for each scenario type on one axis, contestants in the order of the whole table."""
    from matplotlib.figure import Figure

    across = min(len(parts), 3)
    down = math.ceil(len(parts) / across)
    with house_style():
        names_in, plot_in = names_width_in(rows, 7.0) + 0.2, 0.26 * len(rows)
        between_in, foot_in = 0.6, 0.15
        wide, high = names_in + 2.1 * across, (plot_in + between_in) * down + foot_in
        figure = Figure(figsize=(wide, high))
        panels = list(figure.subplots(down, across, sharex=True, squeeze=False).flat)
        figure.subplots_adjust(
            left=names_in / wide,
            right=1.0 - 0.1 / wide,
            top=1.0 - 0.25 / high,
            bottom=(foot_in + 0.25) / high,
            wspace=0.08,
            hspace=between_in / plot_in,
        )
        for number, (panel, part) in enumerate(zip(panels, parts, strict=False)):
            lines = {line.slug: line for line in part.lines}
            for place, row in enumerate(rows):
                if line := lines.get(row.slug):
                    bounds = (line.lower, line.rating, line.upper)
                    draw_interval(panel, place, bounds, simulated=row.simulated)
            panel.set_title(f"{part.label} (n {part.votes})", fontsize=7, color=INK)
            name_rows(panel, rows, fontsize=7.0)
            if number % across:
                panel.set_yticklabels([""] * len(rows))
            panel.tick_params(axis="x", labelsize=7, labelbottom=True)
            rating_axis(panel, len(rows))
        for panel in panels[len(parts) :]:
            panel.set_visible(False)
        text = "Elo with 95 % intervals, each type rated by itself"
        figure.text(0.5, 0.08 / high, text, ha="center", fontsize=8, color=INK)
        return write_figure(figure, file_format)


# --- Pairs -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class HeatCell:
    """One contestant against another.

    Attributes:
        share: The row's mean score, a tie half; None without votes.
        step: How far towards the row it is, 0 to 10; the colour.
        planned: How often the pair was to be judged, None where nothing was planned.
    """

    other: Row
    share: float | None
    step: int
    votes: int
    planned: int | None
    is_few: bool

    @property
    def percent(self) -> int | None:
        """The share in percent."""
        return None if self.share is None else whole_percent(self.share)


@dataclass(frozen=True, slots=True, kw_only=True)
class HeatRow:
    """A row of the table; the cell against itself is None."""

    number: int
    row: Row
    cells: list[HeatCell | None]


def heat_map(pairs: Sequence[PairRecord], rows: Sequence[Row]) -> list[HeatRow]:
    """The scores of all against all, contestants in the given order both ways."""
    scores: dict[tuple[str, str], tuple[float, PairRecord]] = {}
    for pair in pairs:
        score = pair.wins + pair.ties / 2
        scores[pair.a, pair.b] = (score, pair)
        scores[pair.b, pair.a] = (pair.votes - score, pair)

    def cell(row: Row, other: Row) -> HeatCell | None:
        if row.slug == other.slug:
            return None
        score, pair = scores.get((row.slug, other.slug), (0.0, None))
        votes = pair.votes if pair else 0
        share = score / votes if votes else None
        towards = 0.0 if share is None else (share - 0.5) / STRONG
        return HeatCell(
            other=other,
            share=share,
            step=round(STEPS * (min(max(towards, -1.0), 1.0) + 1.0) / 2.0),
            votes=votes,
            planned=pair.planned if pair else None,
            is_few=votes < FEW,
        )

    return [
        HeatRow(number=number, row=row, cells=[cell(row, other) for other in rows])
        for number, row in enumerate(rows, start=1)
    ]


def heat_chart(rows: Sequence[Row], pairs: Sequence[PairRecord], *, file_format: str) -> bytes:
    """Percent and number of votes in every cell, contestants in the given order."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    lines = heat_map(pairs, rows)
    with house_style():
        names_in = names_width_in(rows, 8.0) + 0.45
        side_in, foot_in = 0.62 * max(len(rows), 2), 0.5
        wide, high = max(names_in + side_in, 3.9) + 0.1, side_in + foot_in + 0.1
        figure = Figure(figsize=(wide, high))
        axes = figure.add_axes((names_in / wide, foot_in / high, side_in / wide, side_in / high))
        shares = [
            [math.nan if cell is None or cell.share is None else cell.share for cell in line.cells]
            for line in lines
        ]
        colours = LinearSegmentedColormap.from_list("score", _COLOURS)
        axes.imshow(shares, cmap=colours, vmin=0.5 - STRONG, vmax=0.5 + STRONG)
        centred: dict[str, Any] = {"ha": "center", "va": "center", "color": INK}
        for i, line in enumerate(lines):
            for j, cell in enumerate(line.cells):
                if cell is not None and cell.votes:
                    axes.text(j, i - 0.12, f"{cell.percent}", fontsize=9.0, **centred)
                    axes.text(j, i + 0.24, f"{cell.votes}", fontsize=6.5, **centred)
        numbers = [str(line.number) for line in lines]
        axes.set_yticks(range(len(rows)), numbers, fontsize=8)
        axes.set_xticks(range(len(rows)), numbers, fontsize=8)
        for place, row in enumerate(rows):
            axes.annotate(
                row.model,
                (0.0, place),
                (-18.0, 0.0),
                ("axes fraction", "data"),
                "offset points",
                ha="right",
                va="center",
                fontsize=8.0,
                color=SIMULATED if row.simulated else INK,
            )
        axes.tick_params(length=0, colors=INK)
        axes.spines[:].set_visible(False)
        text = "Score of the row in percent, a tie half a win; votes beneath"
        figure.text(0.99, 0.08 / high, text, ha="right", color=SOFT, fontsize=7.5)
        return write_figure(figure, file_format)


# --- Private -----------------------------------------------------------------------------------


def _interval_label(table: LeaderboardTable) -> str:
    marks = {
        "simulated": table.simulated,
        "early": table.early,
        "only within groups comparable": table.has_parts,
    }
    has_intervals = any(row.has_bound for row in table.rows)
    text = "Elo with 95 % intervals" if has_intervals else "Elo, without intervals"
    words = [word for word, holds in marks.items() if holds]
    return f"{text} ({', '.join(words)})" if words else text
