"""Charts as numbers in the picture's own units; the templates only write them down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from arena.exports.plot_axes import interval_ticks, known_ends, shorten_name
from arena.exports.tables import Row
from arena.rating.printed import with_minus

WIDTH = 560.0
LEFT, RIGHT = 196.0, 500.0
"""Where the plot begins and ends; names stand to its left, values to its right."""

TOP, ROW = 16.0, 34.0
LONGEST_NAME = 26

BAR_LEFT, BAR_RIGHT = 6.0, 254.0
"""The same for an interval inside a table's cell, 260 units wide."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalRow:
    """One contestant: a dot at the rating if there is one, a line over its interval.

    Attributes:
        is_open_low, is_open_high: There is no such bound; the line goes on to the edge.
    """

    name: str
    y: float
    low_x: float
    x: float | None
    high_x: float
    is_open_low: bool
    is_open_high: bool
    value: str
    title: str
    is_simulated: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Tick:
    """A line of an axis; `x` is how far along the picture it is."""

    x: float
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalChart:
    """Ratings with their intervals on one axis."""

    width: float
    height: float
    bottom: float
    rows: list[IntervalRow]
    ticks: list[Tick]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """An interval inside a table's cell; the middle is a dot, an open end goes on to the edge."""

    low_x: float
    x: float | None
    high_x: float
    is_open_low: bool
    is_open_high: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Bars:
    """The bars of a table's lines by their keys, on one axis from `first` to `last`."""

    first: float
    last: float
    by_key: dict[str, Bar]


Span = tuple[float, float]


def interval_chart(table: Sequence[Row], span: Span | None = None) -> IntervalChart | None:
    """The chart of all lines with an interval, be it open on one side; None without any.

    Args:
        table: Lines from top to bottom.
        span: What the axis has to cover beside them, so that several charts have the same.
    """
    drawn = [line for line in table if known_ends(line.interval)]
    marks = interval_ticks((line.interval for line in drawn), span)
    if not marks:
        return None
    first, extent = marks[0], marks[-1] - marks[0]

    def at(value: float) -> float:
        return round(LEFT + (RIGHT - LEFT) * (value - first) / extent, 1)

    bottom = TOP + ROW * len(drawn)
    return IntervalChart(
        width=WIDTH,
        height=bottom + 26.0,
        bottom=bottom,
        rows=[
            IntervalRow(
                name=shorten_name(line.name, LONGEST_NAME),
                y=TOP + ROW * (n + 0.5),
                low_x=LEFT if line.lower is None else at(line.lower),
                x=None if line.rating is None else at(line.rating),
                high_x=RIGHT if line.upper is None else at(line.upper),
                is_open_low=line.lower is None,
                is_open_high=line.upper is None,
                value=line.interval_text if line.rating is None else line.elo_text,
                title=_title(line),
                is_simulated=line.simulated,
            )
            for n, line in enumerate(drawn)
        ],
        ticks=[Tick(x=at(mark), label=f"{mark:g}") for mark in marks],
    )


def bars(
    values: Sequence[tuple[str, float | None, float | None, float | None]],
    span: Span | None = None,
) -> Bars | None:
    """Bars for a table's cells, None if no line has an interval.

    Args:
        values: Key, lower end, middle and upper end of each line; with one end alone the bar goes
            on to the edge.
        span: The axis; round numbers around the lines unless given.
    """
    known = [
        (key, low, middle, high)
        for key, low, middle, high in values
        if known_ends((low, middle, high))
    ]
    if not known:
        return None
    marks = span or interval_ticks(line[1:] for line in known)
    first, last = marks[0], marks[-1]

    def at(value: float) -> float:
        share = (min(max(value, first), last) - first) / (last - first)
        return round(BAR_LEFT + (BAR_RIGHT - BAR_LEFT) * share, 1)

    by_key = {
        key: Bar(
            low_x=BAR_LEFT if low is None else at(low),
            x=None if middle is None else at(middle),
            high_x=BAR_RIGHT if high is None else at(high),
            is_open_low=low is None,
            is_open_high=high is None,
        )
        for key, low, middle, high in known
    }
    return Bars(first=first, last=last, by_key=by_key)


def _title(line: Row) -> str:
    """What the chart says of a line when asked."""
    if line.rating is None or line.lower is None or line.upper is None:
        numbers = f"{with_minus(line.elo_text)} ({with_minus(line.interval_text)})"
        return f"{line.model}: {numbers}"
    return "{name}: {rating}, 95 % from {low} to {high}".format(
        name=line.model,
        rating=with_minus(f"{line.rating:.0f}"),
        low=with_minus(f"{line.lower:.0f}"),
        high=with_minus(f"{line.upper:.0f}"),
    )
