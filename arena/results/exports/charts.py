"""What all charts for papers share: the colours, and bytes that never differ between two runs."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, Protocol

from arena.models import Snapshot
from arena.rating.printed import whole_percent
from arena.rating.snapshot_document import PairRecord, TypeRating
from arena.results.exports.plots import Interval, interval_ticks, plots, scatter_chart
from arena.results.exports.tables import LeaderboardTable, Row, leaderboard_table
from augment.errors import UnknownName

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


INK, SOFT, GRID, MARK, SIMULATED = "#1d2733", "#5b6773", "#d5dbe3", "#2f6db5", "#7a4fae"
DPI = 200

# Nothing that differs between two runs may get into a file: no date, no random ids, no version.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}

_ONE_AT_A_TIME = Lock()


@contextmanager
def house_style() -> Iterator[None]:
    """The settings of matplotlib under which every chart is drawn.

    They belong to the whole process: a chart that ends would take them away from one that another
    thread of the web server is drawing. So charts wait for each other.
    """
    import matplotlib

    settings: dict[Any, Any] = {
        "svg.hashsalt": "scenario-arena",
        "svg.fonttype": "none",
        "pdf.fonttype": 42,  # publishers refuse Type 3, matplotlib's usual form
        "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    }
    with _ONE_AT_A_TIME, matplotlib.rc_context(settings):
        yield


def width_in(text: str, size_pt: float) -> float:
    """How many inches a text takes; call it within `house_style`."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0.0, 0.0), text, size=size_pt).get_extents().width) / 72.0


def write_figure(figure: Figure, file_format: str) -> bytes:
    """The figure as the bytes of a file.

    Args:
        figure: Made and filled within `house_style`.
        file_format: "svg", "pdf" or "png".
    """
    picture = io.BytesIO()
    figure.savefig(picture, format=file_format, dpi=DPI, metadata=_METADATA[file_format])
    return picture.getvalue()


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


STRONG = 0.3
"""So far from even a score has the full colour: experts who tie often leave little beyond."""
STEPS = 10
FEW = 30


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
    """The table, contestants in the given order both ways.

    Args:
        pairs: As a snapshot keeps them: wins, ties and losses of `a` against `b`.
        rows: The contestants.
    """
    found: dict[tuple[str, str], tuple[float, int, int | None]] = {}
    for pair in pairs:
        score = pair.wins + pair.ties / 2
        found[pair.a, pair.b] = (score, pair.votes, pair.planned)
        found[pair.b, pair.a] = (pair.votes - score, pair.votes, pair.planned)
    return [
        HeatRow(number=n, row=row, cells=[_cell(row, other, found) for other in rows])
        for n, row in enumerate(rows, start=1)
    ]


def _step(share: float) -> int:
    towards = (share - 0.5) / STRONG
    return round(STEPS * (min(max(towards, -1.0), 1.0) + 1.0) / 2.0)


def _cell(
    row: Row, other: Row, found: dict[tuple[str, str], tuple[float, int, int | None]]
) -> HeatCell | None:
    if row.slug == other.slug:
        return None
    score, votes, planned = found.get((row.slug, other.slug), (0.0, 0, None))
    share = score / votes if votes else None
    return HeatCell(
        other=other,
        share=share,
        step=_step(0.5 if share is None else share),
        votes=votes,
        planned=planned,
        is_few=votes < FEW,
    )


_CELL_IN, _FOOT_IN, _FEWEST_IN = 0.62, 0.5, 3.9
_NAME_PT = 8.0
_COLOURS = ("#f0a15c", "#f7f8f8", "#6aa5db")
"""Orange for the column, blue for the row: told apart with any colour vision."""


def heat_chart(rows: Sequence[Row], pairs: Sequence[PairRecord], *, file_format: str) -> bytes:
    """Percent and number of votes in every cell, contestants in the given order.

    Args:
        rows: The contestants.
        pairs: As a snapshot keeps them.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    lines = heat_map(pairs, rows)
    numbers = [str(n) for n in range(1, len(rows) + 1)]
    with house_style():
        names_in = max((width_in(row.model, _NAME_PT) for row in rows), default=0.0) + 0.45
        side = _CELL_IN * max(len(rows), 2)
        wide, high = max(names_in + side, _FEWEST_IN) + 0.1, side + _FOOT_IN + 0.1
        figure = Figure(figsize=(wide, high))
        axes = figure.add_axes((names_in / wide, _FOOT_IN / high, side / wide, side / high))
        colours = LinearSegmentedColormap.from_list("score", _COLOURS)
        shares = [
            [math.nan if cell is None or cell.share is None else cell.share for cell in line.cells]
            for line in lines
        ]
        axes.imshow(shares, cmap=colours, vmin=0.5 - STRONG, vmax=0.5 + STRONG)
        for i, line in enumerate(lines):
            for j, cell in enumerate(line.cells):
                if cell is not None and cell.votes:
                    _write(axes, f"{cell.percent}", j, i - 0.12, 9.0)
                    _write(axes, f"{cell.votes}", j, i + 0.24, 6.5)
        axes.set_yticks(range(len(rows)), numbers, fontsize=8)
        axes.set_xticks(range(len(rows)), numbers, fontsize=8)
        for place, row in enumerate(rows):
            axes.annotate(
                row.model, (0.0, place), (-18.0, 0.0), ("axes fraction", "data"),
                "offset points", ha="right", va="center", fontsize=_NAME_PT,
                color=SIMULATED if row.simulated else INK,
            )  # fmt: skip
        axes.tick_params(length=0, colors=INK)
        axes.spines[:].set_visible(False)
        figure.text(
            0.99, 0.08 / high, "Score of the row in percent, a tie half a win; votes beneath",
            ha="right", color=SOFT, fontsize=7.5,
        )  # fmt: skip
        return write_figure(figure, file_format)


def _write(axes: Axes, text: str, x: float, y: float, size: float) -> None:
    """Inside a cell; ink keeps a contrast of 4.5 on every colour."""
    axes.text(x, y, text, ha="center", va="center", fontsize=size, color=INK)


_PANEL_IN, _ROW_IN_types, _MOST_ACROSS = 2.1, 0.26, 3
_BETWEEN_IN, _FOOT_IN_types = 0.6, 0.15
_NAME_PT_types = 7.0


def type_charts(
    parts: Sequence[TypeRating], table: LeaderboardTable, *, file_format: str
) -> bytes:
    """A panel a type on one axis, contestants in the order of the whole table.

    Args:
        parts: As a snapshot keeps them.
        table: Whose lines they are.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.figure import Figure

    rows = table.rows
    across = min(len(parts), _MOST_ACROSS)
    down = math.ceil(len(parts) / across)
    with house_style():
        names = max((width_in(row.model, _NAME_PT_types) for row in rows), default=0.0) + 0.2
        plot = _ROW_IN_types * len(rows)
        wide, high = names + _PANEL_IN * across, (plot + _BETWEEN_IN) * down + _FOOT_IN_types
        figure = Figure(figsize=(wide, high))
        panels = list(figure.subplots(down, across, sharex=True, squeeze=False).flat)
        figure.subplots_adjust(
            left=names / wide,
            right=1.0 - 0.1 / wide,
            top=1.0 - 0.25 / high,
            bottom=(_FOOT_IN_types + 0.25) / high,
            wspace=0.08,
            hspace=_BETWEEN_IN / plot,
        )
        for number, (panel, part) in enumerate(zip(panels, parts, strict=False)):
            by_slug = {line.slug: line for line in part.lines}
            for place, row in enumerate(rows):
                line = by_slug.get(row.slug)
                if line is not None:
                    interval = (line.lower, line.rating, line.upper)
                    draw_interval(panel, place, interval, simulated=row.simulated)
            panel.set_title(f"{part.label} (n {part.votes})", fontsize=7, color=INK)
            labels = ["" if number % across else row.model for row in rows]
            panel.set_yticks(range(len(rows)), labels, fontsize=_NAME_PT_types)
            for label, row in zip(panel.get_yticklabels(), rows, strict=True):
                label.set_color(SIMULATED if row.simulated else INK)
            panel.tick_params(axis="x", labelsize=7, labelbottom=True)
            rating_axis(panel, len(rows))
        for panel in panels[len(parts) :]:
            panel.set_visible(False)
        figure.text(
            0.5, 0.08 / high, "Elo with 95 % intervals, each type rated by itself", ha="center",
            fontsize=8, color=INK,
        )  # fmt: skip
        return write_figure(figure, file_format)


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
