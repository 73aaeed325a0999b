"""Charts as numbers in the picture's own units; the templates only write them down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from arena.exports.tables import Row

WIDTH = 760.0
LEFT, RIGHT = 210.0, 676.0
"""Where the plot begins and ends; names stand to its left, values to its right."""

TOP, ROW = 16.0, 34.0
MOST_TICKS = 7
LONGEST_NAME = 30


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
    """A line of the axis."""

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


def interval_chart(table: Sequence[Row]) -> IntervalChart | None:
    """The chart of all lines with a rating and an interval, None if no line has both."""
    rated = [
        (line, line.lower, line.elo, line.upper)
        for line in table
        if line.lower is not None and line.elo is not None and line.upper is not None
    ]
    if not rated:
        return None
    marks = _ticks(min(low for _, low, _, _ in rated), max(high for *_, high in rated))
    first, span = marks[0], marks[-1] - marks[0]

    def at(value: float) -> float:
        return round(LEFT + (RIGHT - LEFT) * (value - first) / span, 1)

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
                title=f"{line.model}: {rating:.0f}, 95 % from {low:.0f} to {high:.0f}",
                is_simulated=line.simulated,
            )
            for n, (line, low, rating, high) in enumerate(rated)
        ],
        ticks=[Tick(x=at(mark), label=f"{mark:g}") for mark in marks],
    )


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers that enclose low..high, at most MOST_TICKS steps apart."""
    span = max(high - low, 1.0)
    power = 10.0 ** math.floor(math.log10(span / MOST_TICKS))
    step = next(power * f for f in (1, 2, 5, 10) if span / (power * f) <= MOST_TICKS)
    first, last = math.floor(low / step), math.ceil(high / step)
    return [step * n for n in range(first, max(last, first + 1) + 1)]


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 1] + "…"
