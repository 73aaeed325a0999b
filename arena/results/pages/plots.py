"""Intervals of a table drawn on its page: where each lies on the axis that all lines share."""

import math
from collections.abc import Sequence
from typing import Any

from arena.rating.lines import Line

MOST_TICKS = 5


PlacedInterval = dict[str, float]
"""Rating, lower and upper bound in percent of the axis; without a bound it reaches to the edge."""


def plot(rows: Sequence[Line]) -> dict[str, Any]:
    """Lines with their marks, None for who has no rating, and the ticks of the axis."""
    bounds = [value for row in rows for value in row.interval if value is not None]
    step = _step(max(bounds, default=1000.0) - min(bounds, default=1000.0))
    first = math.floor(min(bounds, default=1000.0) / step)
    last = max(math.ceil(max(bounds, default=1000.0) / step), first + 1)

    def place(value: float | None, default: float) -> float:
        at = 100.0 * (value / step - first) / (last - first) if value is not None else default
        return round(at, 2)

    def mark(row: Line) -> PlacedInterval | None:
        if row.rating is None:
            return None
        edges = {"lower": 0.0, "rating": 0.0, "upper": 100.0}
        return {name: place(getattr(row, name), edge) for name, edge in edges.items()}

    ticks = [
        (round(number * step), place(number * step, 0.0)) for number in range(first, last + 1)
    ]
    return {"lines": [{"row": row, "mark": mark(row)} for row in rows], "ticks": ticks}


def _step(width: float) -> float:
    """Points between ticks: 1, 2 or 5 times a power of ten, so that there are few."""
    least = max(width, 1.0) / (MOST_TICKS - 1)
    power = 10.0 ** math.floor(math.log10(least))
    return next(step for factor in (1, 2, 5, 10) if (step := factor * power) >= least)
