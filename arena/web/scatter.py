"""Scatter charts as numbers in the picture's own units: numbered points with an interval upwards.

A point's number stands in it and in the table beneath the chart, so no label covers another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from arena.exports.badges import badge_places
from arena.exports.plot_axes import axes, curve_points
from arena.exports.plots import Plot
from arena.web.charts import Tick

HEIGHT = 404.0
LEFT, TOP, BOTTOM = 82.0, 14.0, 342.0
MARGIN_RIGHT = 32.0
WIDE, NARROW = 760.0, 540.0
"""A chart across the page, and one of two beside each other."""

RIGHT = WIDE - MARGIN_RIGHT
RADIUS = 10.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A point in units of the picture.

    Attributes:
        is_open_low, is_open_high: The interval has no such bound and goes on to the edge.
        badge_x, badge_y: Where its number stands; beside it where another one is in the way.
    """

    number: int
    title: str
    x: float
    y: float
    badge_x: float
    badge_y: float
    low_y: float | None
    high_y: float | None
    is_open_low: bool
    is_open_high: bool
    group: str
    is_simulated: bool

    @property
    def is_moved(self) -> bool:
        """Whether its number stands beside it."""
        return (self.badge_x, self.badge_y) != (self.x, self.y)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """Points, the marks of both axes, and a curve through the plot if there is one.

    Attributes:
        across_label, up_label: What the axes say.
    """

    width: float
    height: float
    left: float
    right: float
    top: float
    bottom: float
    points: list[Point]
    across: list[Tick]
    up: list[Tick]
    across_label: str
    up_label: str
    curve: str

    @property
    def middle_x(self) -> float:
        """Where the title of the axis across stands."""
        return (self.left + self.right) / 2

    @property
    def middle_y(self) -> float:
        """Where the title of the axis up stands."""
        return (self.top + self.bottom) / 2


def scatter(plot: Plot | None, *, width: float = WIDE) -> Scatter | None:
    """The chart, None without points.

    Args:
        plot: The points; on a logarithmic axis all x are above zero.
        width: Of the picture.
    """
    if plot is None or not plot.points:
        return None
    given = plot.points
    across, up = axes(plot)
    scale = math.log10 if plot.is_log else float
    first, last, right = scale(across[0]), scale(across[-1]), width - MARGIN_RIGHT

    def x_of(value: float) -> float:
        return round(LEFT + (right - LEFT) * (scale(value) - first) / (last - first), 1)

    def y_of(value: float) -> float:
        inside = min(max(value, up[0]), up[-1])
        return round(BOTTOM - (BOTTOM - TOP) * (inside - up[0]) / (up[-1] - up[0]), 1)

    badges = badge_places(
        [(x_of(one.x), y_of(one.y)) for one in given],
        radius=RADIUS,
        box=(LEFT, right, TOP, BOTTOM),
    )
    return Scatter(
        width=width,
        height=HEIGHT,
        left=LEFT,
        right=right,
        top=TOP,
        bottom=BOTTOM,
        points=[
            Point(
                number=one.number,
                title=f"{one.name}: {one.x:.4g}{plot.unit}, {one.y:.4g}",
                x=x_of(one.x),
                y=y_of(one.y),
                badge_x=badge[0],
                badge_y=badge[1],
                low_y=y_of(up[0] if one.lower is None else one.lower) if one.has_bound else None,
                high_y=y_of(up[-1] if one.upper is None else one.upper) if one.has_bound else None,
                is_open_low=one.has_bound and one.lower is None,
                is_open_high=one.has_bound and one.upper is None,
                group=one.group,
                is_simulated=one.is_simulated,
            )
            for one, badge in zip(given, badges, strict=True)
        ],
        across=[Tick(x=x_of(mark), label=f"{mark:g}") for mark in across],
        up=[Tick(x=y_of(mark), label=f"{mark:g}") for mark in up],
        across_label=plot.across,
        up_label=plot.up,
        curve=" ".join(f"{x_of(x)},{y_of(y)}" for x, y in curve_points(plot)),
    )
