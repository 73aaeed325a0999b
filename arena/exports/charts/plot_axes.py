"""The marks of charts' axes: round numbers around what is drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from arena.exports.charts.plots import Plot

MOST_TICKS = 7
FEWEST_TICKS = 4
CURVE_STEPS = 80

Interval = tuple[float | None, float | None, float | None]


def axes(plot: Plot) -> tuple[list[float], list[float]]:
    """The marks across and up, from the first to the last end of each axis."""
    from_zero = plot.from_zero and not plot.is_log
    values = [0.0] * from_zero + [one.x for one in plot.points]
    across = _decades(values) if plot.is_log else _round(values)
    tops = [one.y if one.upper is None else one.upper for one in plot.points]
    lows = [one.y if one.lower is None else one.lower for one in plot.points]
    return across, ticks(0.0 if plot.from_zero else min(lows), max(tops))


def interval_ticks(
    intervals: Iterable[Interval], span: tuple[float, float] | None = None
) -> list[float]:
    """The marks of an axis for intervals; none without any.

    Args:
        intervals: Lower end, middle and upper end of each.
        span: What the axis has to cover beside them, so that several charts have the same.
    """
    ends = [end for interval in intervals for end in known_ends(interval)]
    return ticks(min([*ends, *(span or ())]), max([*ends, *(span or ())])) if ends else []


def known_ends(interval: Interval) -> list[float]:
    """What of an interval there is; nothing without any bound."""
    if interval[0] is None and interval[2] is None:
        return []
    return [end for end in interval if end is not None]


def curve_points(plot: Plot) -> list[tuple[float, float]]:
    """The points of the plot's curve, as far as it stays inside."""
    if plot.curve is None:
        return []
    across, up = axes(plot)
    first, last = across[0], across[-1]
    along = [first + (last - first) * n / CURVE_STEPS for n in range(1, CURVE_STEPS + 1)]
    return [(x, plot.curve(x)) for x in along if x > 0 and plot.curve(x) <= up[-1]]


def shorten_name(name: str, longest: int) -> str:
    """The name, cut with a mark where it is longer."""
    return name if len(name) <= longest else name[: longest - 1] + "…"


def ticks(low: float, high: float) -> list[float]:
    """Round numbers that enclose low..high, at most MOST_TICKS steps apart."""
    span = max(high - low, 1e-9 if high > low else 1.0)
    power = 10.0 ** math.floor(math.log10(span / MOST_TICKS))
    step = next(power * f for f in (1, 2, 5, 10) if span / (power * f) <= MOST_TICKS)
    first, last = math.floor(low / step), math.ceil(high / step)
    return [step * n for n in range(first, max(last, first + 1) + 1)]


# --- Private -----------------------------------------------------------------------------------


def _round(values: Sequence[float]) -> list[float]:
    margin = (max(values) - min(values)) * 0.04 or abs(max(values)) * 0.1 or 1.0
    low = min(values) - margin
    return ticks(0.0 if min(values) >= 0 > low else low, max(values) + margin)


def _decades(values: Sequence[float]) -> list[float]:
    """1, 2, 5 and 10 of every decade that the values touch, from the last mark below on."""
    marks = [
        10.0**power * step
        for power in range(
            math.floor(math.log10(min(values))) - 1, math.ceil(math.log10(max(values))) + 2
        )
        for step in (1, 2, 5)
    ]
    first = max(index for index, mark in enumerate(marks) if mark < min(values) * 0.98)
    last = min(index for index, mark in enumerate(marks) if mark > max(values) * 1.02)
    chosen = marks[first : last + 1]
    if len(chosen) < FEWEST_TICKS:
        return _finer(chosen[0], chosen[-1])
    if len(chosen) <= MOST_TICKS:
        return chosen
    decades = [mark for mark in chosen[1:-1] if math.isclose(math.log10(mark) % 1.0, 0.0)]
    return [chosen[0], *decades, chosen[-1]]


def _finer(first: float, last: float) -> list[float]:
    """More marks of the decades between two, where so few would say little."""
    power = 10.0 ** math.floor(math.log10(first))
    marks = [power * step for step in (1, 1.5, 2, 3, 4, 5, 7, 10, 15, 20, 30, 50, 70, 100)]
    return [mark for mark in marks if first * 0.999 <= mark <= last * 1.001]
