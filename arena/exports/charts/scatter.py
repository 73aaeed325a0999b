"""One thing against another, for papers, drawn by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

from arena.exports.charts.badges import Place, badge_places
from arena.exports.charts.drawing import (
    GRID,
    INK,
    MARK,
    SIMULATED,
    SOFT,
    house_style,
    write_figure,
)
from arena.exports.charts.plot_axes import axes as axes_of
from arena.exports.charts.plot_axes import curve_points, shorten_name
from arena.exports.charts.plots import Given, Plot
from arena.exports.tables import SIMULATED as SIMULATED_WORD

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    across, up = axes_of(plot)
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
