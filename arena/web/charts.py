"""Charts as numbers in the picture's own units; the templates only write them down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from django.utils.translation import gettext as _

from arena.exports.plot_axes import ticks
from arena.exports.tables import Row

WIDTH = 760.0
LEFT, RIGHT = 210.0, 676.0
"""Where the plot begins and ends; names stand to its left, values to its right."""

TOP, ROW = 16.0, 34.0
LONGEST_NAME = 30

BAR_LEFT, BAR_RIGHT = 6.0, 254.0
"""The same for an interval inside a table's cell, 260 units wide."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalRow:
    """One contestant: a dot at the rating, a line over its interval."""

    name: str
    y: float
    low_x: float
    x: float
    high_x: float
    rating: float
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
    """An interval inside a table's cell; the middle is a dot."""

    low_x: float
    x: float
    high_x: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Bars:
    """The bars of a table's lines by their keys, on one axis from `first` to `last`."""

    first: float
    last: float
    by_key: dict[str, Bar]


Span = tuple[float, float]


def interval_chart(table: Sequence[Row], span: Span | None = None) -> IntervalChart | None:
    """The chart of all lines with a rating and an interval, None if no line has both.

    Args:
        table: Lines from top to bottom.
        span: What the axis has to cover beside them, so that several charts have the same.
    """
    rated = [
        (line, line.lower, line.elo, line.upper)
        for line in table
        if line.lower is not None and line.elo is not None and line.upper is not None
    ]
    if not rated:
        return None
    ends = [*(low for _, low, _, _ in rated), *(high for *_, high in rated), *(span or ())]
    marks = ticks(min(ends), max(ends))
    first, extent = marks[0], marks[-1] - marks[0]

    def at(value: float) -> float:
        return round(LEFT + (RIGHT - LEFT) * (value - first) / extent, 1)

    bottom = TOP + ROW * len(rated)
    return IntervalChart(
        width=WIDTH,
        height=bottom + 26.0,
        bottom=bottom,
        rows=[
            IntervalRow(
                name=_short(line.name),
                y=TOP + ROW * (n + 0.5),
                low_x=at(low),
                x=at(rating),
                high_x=at(high),
                rating=rating,
                title=_("%(name)s: %(rating)s, 95 %% from %(low)s to %(high)s")
                % {
                    "name": line.model,
                    "rating": f"{rating:.0f}",
                    "low": f"{low:.0f}",
                    "high": f"{high:.0f}",
                },
                is_simulated=line.simulated,
            )
            for n, (line, low, rating, high) in enumerate(rated)
        ],
        ticks=[Tick(x=at(mark), label=f"{mark:g}") for mark in marks],
    )


def bars(
    values: Sequence[tuple[str, float | None, float | None, float | None]],
    span: Span | None = None,
) -> Bars | None:
    """Bars for a table's cells, None if no line has an interval.

    Args:
        values: Key, lower end, middle and upper end of each line.
        span: The axis; round numbers around the lines unless given.
    """
    known = [
        (key, low, middle, high)
        for key, low, middle, high in values
        if low is not None and middle is not None and high is not None
    ]
    if not known:
        return None
    if span is None:
        marks = ticks(min(low for _, low, _, _ in known), max(high for *_, high in known))
        span = marks[0], marks[-1]
    first, last = span

    def at(value: float) -> float:
        share = (min(max(value, first), last) - first) / (last - first)
        return round(BAR_LEFT + (BAR_RIGHT - BAR_LEFT) * share, 1)

    found = {key: Bar(low_x=at(low), x=at(mid), high_x=at(high)) for key, low, mid, high in known}
    return Bars(first=first, last=last, by_key=found)


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 1] + "…"
