"""Scatter charts of a rating: points as numbers for pages, and drawn by matplotlib for files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from arena.models import Snapshot
from arena.results.exports.drawing import (
    GRID,
    INK,
    MARK,
    MOST_TICKS,
    SIMULATED,
    SOFT,
    house_style,
    round_ticks,
    write_figure,
)
from arena.results.exports.tables import LeaderboardTable, Row, shown_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ELO = "Elo with 95 % interval"
METRES = "Median displacement (m)"
USD = "USD per scenario"
TOKENS = "Tokens per scenario"
VOTES = "Votes"
HALF_WIDTH = "Half-width of the interval (Elo)"
FEWEST_TICKS = 4
LONGEST_NAME = 38

_SIZE_IN = (6.4, 3.6)
_LEFT_IN, _BOTTOM_IN, _TOP_IN, _KEY_IN, _LINE_IN = 0.75, 0.55, 0.12, 2.3, 0.22
_RADIUS_IN = 0.085
_LOOKS = {
    "frontier": ("#2f6db5", "o", "frontier"),
    "utility": ("#2c7a4b", "s", "utility"),
    "open_weight": ("#a35a00", "D", "open weight"),
}
"""Colour, shape and word of a class of models."""

Place = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """What is to be drawn; points of the same group look the same.

    Attributes:
        number: Its place in the table.
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
    def look(self) -> tuple[str, str]:
        """Colour and shape."""
        colour, shape, _ = _LOOKS.get(self.group, (MARK, "o", ""))
        return (SIMULATED if self.is_simulated else colour), shape


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
    points: Sequence[Point]
    is_log: bool = False
    from_zero: bool = False
    falls: float | None = None


def plots(snapshot: Snapshot, table: LeaderboardTable) -> dict[str, Plot]:
    """Every chart that has points, by the name that files and pages know it by."""
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    costs = {line.slug: line for line in snapshot.results.cost}
    rows = list(enumerate(table.rows, start=1))
    by_name = {
        "width": _width_plot(rows),
        "displacement": Plot(
            across=METRES,
            up=ELO,
            points=[
                _rated(n, row, far)
                for n, row in rows
                if row.rating is not None and (far := metres.get(row.slug)) is not None
            ],
        ),
    }
    for name, label in (("usd", USD), ("tokens", TOKENS)):
        spent = [
            (n, row, amount, cost.model_class)
            for n, row in rows
            if (cost := costs.get(row.slug)) and (amount := getattr(cost, name))
        ]
        by_name[f"elo-{name}"] = Plot(
            across=label,
            up=ELO,
            points=[
                _rated(n, row, x, group) for n, row, x, group in spent if row.rating is not None
            ],
            is_log=True,
        )
        by_name[f"displacement-{name}"] = Plot(
            across=label,
            up=METRES,
            points=[
                _point(n, row, x=x, y=far, group=group)
                for n, row, x, group in spent
                if (far := metres.get(row.slug)) is not None
            ],
            is_log=True,
            from_zero=True,
        )
    return {name: plot for name, plot in by_name.items() if plot.points}


def scatter_chart(plot: Plot, *, file_format: str) -> bytes:
    """Numbered points with their intervals, and beside them a key with their names."""
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
        axes.set_xticks(across, [f"{tick:g}" for tick in across], fontsize=8)
        axes.set_yticks(up, [f"{tick:g}" for tick in up], fontsize=8)
        axes.minorticks_off()
        axes.tick_params(length=0, pad=6, colors=INK)
        axes.grid(color=GRID, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.spines[:].set_visible(False)
        axes.set_xlabel(plot.across, color=INK, fontsize=9)
        axes.set_ylabel(plot.up, color=INK, fontsize=9)
        if plot.falls is not None:
            axes.plot(*_curve(plot.falls, across, up), color=SOFT, linewidth=0.9, linestyle="--")
        _draw_points(axes, plot, (wide, high))
        _draw_key(axes, plot, wide, _LINE_IN / high)
        return write_figure(figure, file_format)


def axis_ticks(plot: Plot) -> tuple[list[float], list[float]]:
    """The ticks across and up, from the first to the last end of each axis."""
    values = [point.x for point in plot.points]
    if plot.is_log:
        across = _log_ticks(min(values), max(values))
    else:
        values += [0.0] * plot.from_zero
        margin = (max(values) - min(values)) * 0.04 or abs(max(values)) * 0.1 or 1.0
        low = min(values) - margin
        across = round_ticks(0.0 if min(values) >= 0 > low else low, max(values) + margin)
    tops = [point.y if point.upper is None else point.upper for point in plot.points]
    lows = [point.y if point.lower is None else point.lower for point in plot.points]
    return across, round_ticks(0.0 if plot.from_zero else min(lows), max(tops))


def badge_places(points: Sequence[Place], *, radius: float, size: Place) -> list[Place]:
    """Place the badge of each point on it where free, else as near as there is room.

    Args:
        points: In the picture's units; earlier ones have the first choice.
        radius: Of a badge.
        size: Width and height of the plot, which badges' centres stay within.
    """
    taken: list[Place] = []
    for point in points:
        free = (
            place
            for place in _places_around(point, radius, size)
            if all(math.dist(place, other) >= 2.1 * radius for other in taken)
        )
        taken.append(next(free, point))
    return taken


# --- Private -----------------------------------------------------------------------------------


def _width_plot(rows: Sequence[tuple[int, Row]]) -> Plot:
    """Half-widths of intervals against votes, with the curve that falls with their root."""
    points = [
        _point(n, row, x=float(row.votes), y=(row.upper - row.lower) / 2)
        for n, row in rows
        if row.lower is not None and row.upper is not None
    ]
    constants = sorted(point.y * point.x**0.5 for point in points)
    falls = constants[len(constants) // 2] if constants else None
    return Plot(across=VOTES, up=HALF_WIDTH, points=points, from_zero=True, falls=falls)


def _rated(number: int, row: Row, x: float, group: str = "") -> Point:
    assert row.rating is not None
    bounds = {"lower": row.lower, "upper": row.upper}
    return _point(number, row, x=x, y=row.rating, group=group, **bounds)


def _point(number: int, row: Row, **values: Any) -> Point:
    return Point(number=number, name=row.name, is_simulated=row.simulated, **values)


def _log_ticks(low: float, high: float) -> list[float]:
    """1, 2, 5 and 10 of every decade that the values touch, from the last tick below on."""
    decades = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 2)
    ticks = [10.0**power * step for power in decades for step in (1, 2, 5)]
    first = max(index for index, tick in enumerate(ticks) if tick < low * 0.98)
    last = min(index for index, tick in enumerate(ticks) if tick > high * 1.02)
    chosen = ticks[first : last + 1]
    if len(chosen) < FEWEST_TICKS:
        power = 10.0 ** math.floor(math.log10(chosen[0]))
        finer = [power * step for step in (1, 1.5, 2, 3, 4, 5, 7, 10, 15, 20, 30, 50, 70, 100)]
        return [tick for tick in finer if chosen[0] * 0.999 <= tick <= chosen[-1] * 1.001]
    if len(chosen) <= MOST_TICKS:
        return chosen
    whole = [tick for tick in chosen[1:-1] if math.isclose(math.log10(tick) % 1.0, 0.0)]
    return [chosen[0], *whole, chosen[-1]]


def _curve(falls: float, across: Sequence[float], up: Sequence[float]) -> tuple[Any, Any]:
    """X and y of falls / sqrt(x), as far as it stays inside of the axes."""
    xs = np.linspace(across[0], across[-1], 81)[1:]
    ys = falls / np.sqrt(xs)
    return xs[ys <= up[-1]], ys[ys <= up[-1]]


def _places_around(point: Place, radius: float, size: Place) -> Iterator[Place]:
    """The point, then rings around it; sideways first, as intervals stand upright."""
    yield point
    for ring in range(2, 40):
        for turn in range(12):
            angle = math.tau * ((turn + 1) // 2 * (-1) ** turn) / 12
            x = point[0] + ring * 1.1 * radius * math.cos(angle)
            y = point[1] + ring * 1.1 * radius * math.sin(angle)
            if 0.0 <= x <= size[0] and 0.0 <= y <= size[1]:
                yield round(x, 1), round(y, 1)


def _groups(plot: Plot) -> list[str]:
    return sorted({point.group for point in plot.points} & set(_LOOKS))


def _draw_points(axes: Axes, plot: Plot, size_in: Place) -> None:
    """Draw intervals first, badges on top; places in inches from the plot's lower left corner."""
    to_shares = axes.transData + axes.transAxes.inverted()
    shares = to_shares.transform([(point.x, point.y) for point in plot.points])
    places = [(float(x) * size_in[0], float(y) * size_in[1]) for x, y in shares]
    badges = badge_places(places, radius=_RADIUS_IN, size=size_in)
    for point, place, badge in zip(plot.points, places, badges, strict=True):
        colour, shape = point.look
        if point.lower is not None or point.upper is not None:
            _draw_bar(axes, point, colour)
        x, y = badge[0] / size_in[0], badge[1] / size_in[1]
        if badge != place:
            axes.plot(
                [place[0] / size_in[0], x],
                [place[1] / size_in[1], y],
                color=colour,
                linewidth=0.7,
                transform=axes.transAxes,
                marker="o",
                markersize=2.5,
                markevery=[0],
            )
        axes.plot(
            [x],
            [y],
            marker=shape,
            markersize=_RADIUS_IN * 144,
            color=colour,
            markeredgecolor="white",
            markeredgewidth=0.8,
            transform=axes.transAxes,
            zorder=5,
            clip_on=False,
        )
        axes.text(
            x,
            y,
            str(point.number),
            transform=axes.transAxes,
            ha="center",
            va="center_baseline",
            fontsize=7,
            fontweight="bold",
            color="white",
            zorder=6,
        )


def _draw_bar(axes: Axes, point: Point, colour: str) -> None:
    """Draw an interval from end to end; where one is open, to the edge with an arrowhead."""
    ends = (point.lower, point.upper)
    low, high = (
        edge if end is None else end for end, edge in zip(ends, axes.get_ylim(), strict=True)
    )
    axes.plot([point.x] * 2, [low, high], color=colour, linewidth=1.2)
    for end, edge, arrow in zip(ends, (low, high), "v^", strict=True):
        if end is None:
            axes.plot([point.x], [edge], marker=arrow, markersize=5, color=colour, clip_on=False)


def _draw_key(axes: Axes, plot: Plot, wide_in: float, step: float) -> None:
    """Write numbers with names, then what the shapes mean."""
    left = 1.0 + 0.22 / wide_in
    text: dict[str, Any] = {"transform": axes.transAxes, "fontsize": 7, "va": "center"}
    for line, point in enumerate(plot.points):
        y = 1.0 - (line + 0.4) * step
        name = shown_name(point.name, point.is_simulated)
        if len(name) > LONGEST_NAME:
            name = name[: LONGEST_NAME - 1] + "…"
        axes.text(left, y, str(point.number), fontweight="bold", color=point.look[0], **text)
        axes.text(left + 0.17 / wide_in, y, name, color=INK, **text)
    for line, group in enumerate(_groups(plot), start=len(plot.points) + 1):
        colour, shape, word = _LOOKS[group]
        if all(point.is_simulated for point in plot.points if point.group == group):
            colour = SIMULATED
        y = 1.0 - (line + 0.4) * step
        axes.plot(
            [left + 0.04 / wide_in],
            [y],
            marker=shape,
            markersize=5,
            color=colour,
            transform=axes.transAxes,
            clip_on=False,
        )
        axes.text(left + 0.17 / wide_in, y, word, color=SOFT, **text)
