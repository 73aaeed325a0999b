"""The scatter charts of a rating as numbers: pages and files draw the same points."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from arena.models import Snapshot
from arena.results.exports.charts import (
    GRID,
    INK,
    MARK,
    SIMULATED,
    SOFT,
    house_style,
    write_figure,
)
from arena.results.exports.tables import SIMULATED as SIMULATED_WORD
from arena.results.exports.tables import LeaderboardTable, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes


ELO = "Elo with 95 % interval"
METRES = "Median displacement (m)"
USD = "USD per scenario"
TOKENS = "Tokens per scenario"
VOTES = "Votes"
HALF_WIDTH = "Half-width of the interval (Elo)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """What is to be drawn; points of the same group look the same.

    Attributes:
        number: Of the point, its place in the table.
        lower, upper: The ends of the interval in y; one alone is open on the other side.
    """

    number: int
    name: str
    x: float
    y: float
    lower: float | None = None
    upper: float | None = None
    group: str = ""
    is_simulated: bool = False

    @property
    def has_bound(self) -> bool:
        """Whether there is an interval, be it open on one side."""
        return self.lower is not None or self.upper is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """A chart of one thing against another.

    Attributes:
        across, up: What the axes say.
        is_log: Whether the axis across is logarithmic.
        from_zero: Whether the axes begin at zero, a logarithmic one excepted.
        falls: Draws the curve `falls` / sqrt(x) behind the points, None without one.
    """

    across: str
    up: str
    points: Sequence[Given]
    is_log: bool = False
    from_zero: bool = False
    falls: float | None = None

    @property
    def curve(self) -> Callable[[float], float] | None:
        """Y by x, of what falls with the square root of x."""
        constant = self.falls
        return None if constant is None else lambda x: constant / math.sqrt(x)


def plots(snapshot: Snapshot, table: LeaderboardTable) -> dict[str, Plot]:
    """Every chart that has points, by the name that files and pages know it by."""
    by_name = {
        "width": _width(table),
        "displacement": _displacement(snapshot, table),
        **_cost(snapshot, table),
    }
    return {name: plot for name, plot in by_name.items() if plot.points}


# --- Private -----------------------------------------------------------------------------------


def _width(table: LeaderboardTable) -> Plot:
    """Half-widths against votes, with the curve that falls with the votes' square root."""
    points = [
        _given(n, row, x=float(row.votes), y=(row.upper - row.lower) / 2)
        for n, row in enumerate(table.rows, start=1)
        if row.lower is not None and row.upper is not None
    ]
    constants = sorted(point.y * point.x**0.5 for point in points)
    return Plot(
        across=VOTES,
        up=HALF_WIDTH,
        points=points,
        from_zero=True,
        falls=constants[len(constants) // 2] if constants else None,
    )


def _displacement(snapshot: Snapshot, table: LeaderboardTable) -> Plot:
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    points = [
        _rated(n, row, far)
        for n, row in enumerate(table.rows, start=1)
        if row.rating is not None and (far := metres.get(row.slug)) is not None
    ]
    return Plot(across=METRES, up=ELO, points=points)


def _cost(snapshot: Snapshot, table: LeaderboardTable) -> dict[str, Plot]:
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    costs = {line.slug: line for line in snapshot.results.cost}
    by_name = {}
    for what, label in (("usd", USD), ("tokens", TOKENS)):
        rows = [
            (n, row, spent, cost.model_class)
            for n, row in enumerate(table.rows, start=1)
            if (cost := costs.get(row.slug)) and (spent := getattr(cost, what))
        ]
        by_name[f"elo-{what}"] = Plot(
            across=label,
            up=ELO,
            points=[
                _rated(n, row, x, group) for n, row, x, group in rows if row.rating is not None
            ],
            is_log=True,
        )
        by_name[f"displacement-{what}"] = Plot(
            across=label,
            up=METRES,
            points=[
                _given(n, row, x=x, y=far, group=group)
                for n, row, x, group in rows
                if (far := metres.get(row.slug)) is not None
            ],
            is_log=True,
            from_zero=True,
        )
    return by_name


def _rated(number: int, row: Row, x: float, group: str = "") -> Given:
    assert row.rating is not None
    return _given(number, row, x=x, y=row.rating, interval=(row.lower, row.upper), group=group)


def _given(
    number: int,
    row: Row,
    *,
    x: float,
    y: float,
    interval: tuple[float | None, float | None] = (None, None),
    group: str = "",
) -> Given:
    return Given(
        number=number,
        name=row.name,
        x=x,
        y=y,
        lower=interval[0],
        upper=interval[1],
        group=group,
        is_simulated=row.simulated,
    )


MOST_TICKS = 7
FEWEST_TICKS = 4
CURVE_STEPS = 80

Interval = tuple[float | None, float | None, float | None]


def axis_ticks(plot: Plot) -> tuple[list[float], list[float]]:
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
    across, up = axis_ticks(plot)
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


Place = tuple[float, float]
Box = tuple[float, float, float, float]
"""Left, right, top and bottom of the plot."""

_DIRECTIONS = 12
_RINGS = 40


def badge_places(points: Sequence[Place], *, radius: float, box: Box) -> list[Place]:
    """A place for the badge of each point: on it where free, else as near as there is room.

    Args:
        points: In the picture's units; earlier ones have the first choice.
        radius: Of a badge.
        box: What the badges' centres stay in.
    """
    taken: list[Place] = []
    for point in points:
        free = (place for place in _around(point, radius, box) if _is_free(place, taken, radius))
        taken.append(next(free, point))
    return taken


def _around(point: Place, radius: float, box: Box) -> Iterator[Place]:
    """The point, then rings around it; sideways first, as intervals stand upright."""
    yield point
    left, right, top, bottom = box
    for ring in range(2, _RINGS):
        for turn in range(_DIRECTIONS):
            half = (turn + 1) // 2 * (-1) ** turn
            angle = 2.0 * math.pi * half / _DIRECTIONS
            x = point[0] + ring * 1.1 * radius * math.cos(angle)
            y = point[1] + ring * 1.1 * radius * math.sin(angle)
            if left <= x <= right and top <= y <= bottom:
                yield round(x, 1), round(y, 1)


def _is_free(place: Place, taken: Sequence[Place], radius: float) -> bool:
    return all(math.dist(place, other) >= 2.1 * radius for other in taken)


_SIZE_IN = (6.4, 3.6)
_LEFT_IN, _BOTTOM_IN, _TOP_IN = 0.75, 0.55, 0.12
_KEY_IN = 2.3
_LINE_IN = 0.22
_RADIUS_IN = 0.085
_LOOKS = {
    "frontier": ("#2f6db5", "o", "frontier"),
    "utility": ("#2c7a4b", "s", "utility"),
    "open_weight": ("#a35a00", "D", "open weight"),
}
"""Colour, shape and word of a class of models."""


def scatter_chart(plot: Plot, *, file_format: str) -> bytes:
    """Numbered points with their intervals, and beside them whose they are.

    Args:
        plot: With points.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.figure import Figure

    lines = len(plot.points) + len(_groups(plot)) + 1
    height = max(_SIZE_IN[1], _LINE_IN * lines + _TOP_IN + 0.1)
    wide, high = _SIZE_IN[0] - _LEFT_IN - _KEY_IN, height - _BOTTOM_IN - _TOP_IN
    across, up = axis_ticks(plot)
    with house_style():
        figure = Figure(figsize=(_SIZE_IN[0], height))
        axes = figure.add_axes(
            (_LEFT_IN / _SIZE_IN[0], _BOTTOM_IN / height, wide / _SIZE_IN[0], high / height)
        )
        if plot.is_log:
            axes.set_xscale("log")
        axes.set_xlim(across[0], across[-1])
        axes.set_ylim(up[0], up[-1])
        axes.set_xticks(across, [f"{mark:g}" for mark in across], fontsize=8)
        axes.set_yticks(up, [f"{mark:g}" for mark in up], fontsize=8)
        axes.minorticks_off()
        axes.tick_params(length=0, pad=6, colors=INK)
        axes.grid(color=GRID, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.spines[:].set_visible(False)
        axes.set_xlabel(str(plot.across), color=INK, fontsize=9)
        axes.set_ylabel(str(plot.up), color=INK, fontsize=9)
        if plot.curve is not None:
            _curve(axes, plot)
        _points(axes, plot, (wide, high))
        _key(axes, plot, wide)
        return write_figure(figure, file_format)


# --- Private -----------------------------------------------------------------------------------


def _look(point: Given) -> tuple[str, str]:
    """Colour and shape."""
    colour, shape, _ = _LOOKS.get(point.group, (MARK, "o", ""))
    return (SIMULATED if point.is_simulated else colour), shape


def _groups(plot: Plot) -> list[str]:
    return sorted({point.group for point in plot.points} & set(_LOOKS))


def _curve(axes: Axes, plot: Plot) -> None:
    points = curve_points(plot)
    axes.plot(
        [x for x, _ in points], [y for _, y in points], color=SOFT, linewidth=0.9, linestyle="--"
    )


def _points(axes: Axes, plot: Plot, size_in: Place) -> None:
    """Intervals first, badges on top; all places in inches from the plot's lower left corner."""
    to_inches = axes.transData + axes.transAxes.inverted()
    places = []
    for point in plot.points:
        share = to_inches.transform((point.x, point.y))
        places.append((float(share[0]) * size_in[0], float(share[1]) * size_in[1]))
    badges = badge_places(places, radius=_RADIUS_IN, box=(0.0, size_in[0], 0.0, size_in[1]))
    for point, place, badge in zip(plot.points, places, badges, strict=True):
        colour, shape = _look(point)
        if point.has_bound:
            _interval(axes, point, colour)
        ends = [(x / size_in[0], y / size_in[1]) for x, y in (place, badge)]
        if badge != place:
            axes.plot(
                [x for x, _ in ends], [y for _, y in ends], color=colour, linewidth=0.7,
                transform=axes.transAxes, marker="o", markersize=2.5, markevery=[0],
            )  # fmt: skip
        axes.plot(
            [ends[1][0]], [ends[1][1]], marker=shape, markersize=_RADIUS_IN * 144, color=colour,
            markeredgecolor="white", markeredgewidth=0.8, transform=axes.transAxes, zorder=5,
            clip_on=False,
        )  # fmt: skip
        axes.text(
            *ends[1], str(point.number), transform=axes.transAxes, ha="center",
            va="center_baseline", fontsize=7, fontweight="bold", color="white", zorder=6,
        )  # fmt: skip


def _interval(axes: Axes, point: Given, colour: str) -> None:
    """From end to end; where one is open, to the edge with an arrowhead."""
    bottom, top = axes.get_ylim()
    low = bottom if point.lower is None else point.lower
    high = top if point.upper is None else point.upper
    axes.plot([point.x] * 2, [low, high], color=colour, linewidth=1.2)
    if point.lower is None:
        axes.plot([point.x], [low], marker="v", markersize=5, color=colour, clip_on=False)
    if point.upper is None:
        axes.plot([point.x], [high], marker="^", markersize=5, color=colour, clip_on=False)


def _key(axes: Axes, plot: Plot, wide_in: float) -> None:
    """Numbers with names, then what the shapes mean."""
    step = _LINE_IN / (axes.get_position().height * axes.figure.get_figheight())  # type: ignore[union-attr]
    left = 1.0 + 0.22 / wide_in
    for line, point in enumerate(plot.points):
        colour, _ = _look(point)
        name = point.name + (SIMULATED_WORD if point.is_simulated else "")
        y = 1.0 - (line + 0.4) * step
        axes.text(
            left, y, str(point.number), transform=axes.transAxes, fontsize=7, va="center",
            fontweight="bold", color=colour,
        )  # fmt: skip
        axes.text(
            left + 0.17 / wide_in, y, shorten_name(name, _LONGEST), transform=axes.transAxes,
            fontsize=7, va="center", color=INK,
        )  # fmt: skip
    for line, group in enumerate(_groups(plot), start=len(plot.points) + 1):
        colour, shape, word = _LOOKS[group]
        if all(point.is_simulated for point in plot.points if point.group == group):
            colour = SIMULATED
        y = 1.0 - (line + 0.4) * step
        axes.plot(
            [left + 0.04 / wide_in], [y], marker=shape, markersize=5, color=colour,
            transform=axes.transAxes, clip_on=False,
        )  # fmt: skip
        axes.text(
            left + 0.17 / wide_in, y, word, transform=axes.transAxes, fontsize=7, va="center",
            color=SOFT,
        )  # fmt: skip


_LONGEST = 38
