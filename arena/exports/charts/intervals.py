"""Ratings with their intervals, drawn by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

from arena.exports.charts.drawing import GRID, INK, MARK, SIMULATED, house_style, write_figure
from arena.exports.charts.plot_axes import Interval, interval_ticks
from arena.exports.tables import LeaderboardTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW_IN = 0.34


def interval_chart(table: LeaderboardTable, *, file_format: str) -> bytes:
    """The ratings as dots with their intervals as bars, best on top; diamonds are simulated.

    Args:
        table: Contestants without a rating keep their line, without a dot.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=(6.4, 1.1 + _ROW_IN * len(table.rows)), layout="constrained")
        axes = figure.add_subplot()
        for place, row in enumerate(table.rows):
            draw_interval(axes, place, row.interval, simulated=row.simulated)
        axes.set_yticks(range(len(table.rows)), [row.model for row in table.rows])
        for label, row in zip(axes.get_yticklabels(), table.rows, strict=True):
            label.set_color(SIMULATED if row.simulated else INK)
        axes.set_xlabel(_label(table), color=INK)
        rating_axis(axes, len(table.rows))
        ratings = [row.rating for row in table.rows if row.rating is not None]
        span = (min(ratings), max(ratings)) if ratings else None
        marks = interval_ticks((row.interval for row in table.rows), span)
        if marks:
            axes.set_xlim(marks[0], marks[-1])
            axes.set_xticks(marks, [f"{mark:g}" for mark in marks])
        return write_figure(figure, file_format)


def draw_interval(axes: Axes, place: int, interval: Interval, *, simulated: bool) -> None:
    """One line: a mark at the rating, a bar over the interval, an arrow to where it is open.

    Nothing without a rating and bounds, a mark alone without an interval; a bound alone begins
    with a stroke.
    """
    lower, middle, upper = interval
    colour, shape = (SIMULATED, "D") if simulated else (MARK, "o")
    known = [one for one in (lower, middle, upper) if one is not None]
    if not known:
        return
    if len(known) > 1:
        axes.plot([known[0], known[-1]], [place, place], color=colour, linewidth=1.6)
    if middle is None:
        axes.plot(known, [place], marker="|", markersize=9, markeredgewidth=1.6, color=colour)
    else:
        axes.plot([middle], [place], marker=shape, markersize=5, color=colour)
    if (lower is None) != (upper is None):
        start, edge = (known[0], 0.0) if lower is None else (known[-1], 1.0)
        axes.annotate(
            "", (edge, place), (start, place), axes.get_yaxis_transform(), "data",
            arrowprops={
                "arrowstyle": "->", "color": colour, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0,
            },
        )  # fmt: skip


def rating_axis(axes: Axes, rows: int) -> None:
    """Ratings across, lines from top to bottom."""
    axes.set_ylim(rows - 0.5, -0.5)
    axes.grid(axis="x", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _label(table: LeaderboardTable) -> str:
    marks = [word for word, so in (("simulated", table.simulated), ("early", table.early)) if so]
    has_intervals = any(row.has_bound for row in table.rows)
    text = "Elo with 95 % intervals" if has_intervals else "Elo, without intervals"
    if table.has_parts:
        marks.append("only within groups comparable")
    return text + (f" ({', '.join(marks)})" if marks else "")
