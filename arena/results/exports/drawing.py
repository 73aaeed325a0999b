"""Shared parts of all charts: colours, axes, intervals, and files with reproducible bytes."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING, Any

from arena.results.exports.tables import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT, GRID, MARK, SIMULATED = "#1d2733", "#5b6773", "#d5dbe3", "#2f6db5", "#7a4fae"
DPI = 200
MOST_TICKS = 7

Interval = tuple[float | None, float | None, float | None]
"""Lower bound, rating, upper bound."""

NO_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
"""No date, random id or version may get into a file, so that its bytes never differ."""

_LOCK = Lock()


@contextmanager
def house_style() -> Iterator[None]:
    """Apply the settings of matplotlib under which every chart is drawn, one chart at a time.

    The settings belong to the whole process, so threads of the web server have to take turns.
    """
    import matplotlib

    settings: dict[Any, Any] = {
        "svg.hashsalt": "scenario-arena",
        "svg.fonttype": "none",
        "pdf.fonttype": 42,  # publishers refuse Type 3, matplotlib's default
        "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    }
    with _LOCK, matplotlib.rc_context(settings):
        yield


def names_width_in(rows: Sequence[Row], size_pt: float) -> float:
    """Return how many inches the longest name takes; call it within `house_style`."""
    from matplotlib.textpath import TextPath

    widths = (
        TextPath((0.0, 0.0), row.model, size=size_pt).get_extents().width / 72.0 for row in rows
    )
    return max(map(float, widths), default=0.0)


def write_figure(figure: Figure, file_format: str) -> bytes:
    """Return the bytes of an "svg", "pdf" or "png" file; call it within `house_style`."""
    picture = io.BytesIO()
    figure.savefig(picture, format=file_format, dpi=DPI, metadata=NO_METADATA[file_format])
    return picture.getvalue()


def name_rows(axes: Axes, rows: Sequence[Row], **text: Any) -> None:
    """Write the contestants' names beside the lines of a chart, simulated ones in their colour."""
    axes.set_yticks(range(len(rows)), [row.model for row in rows], **text)
    for label, row in zip(axes.get_yticklabels(), rows, strict=True):
        label.set_color(SIMULATED if row.simulated else INK)


def draw_interval(axes: Axes, place: int, interval: Interval, *, simulated: bool) -> None:
    """Draw a mark at the rating and a bar over the interval, with an arrow where it is open.

    Nothing without a rating and bounds; a bound alone begins with a stroke.
    """
    lower, middle, upper = interval
    colour, shape = (SIMULATED, "D") if simulated else (MARK, "o")
    known = [value for value in interval if value is not None]
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
        arrow = {"arrowstyle": "->", "color": colour, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
        axes.annotate(
            "", (edge, place), (start, place), axes.get_yaxis_transform(), "data", arrowprops=arrow
        )


def rating_axis(axes: Axes, rows: int) -> None:
    """Put ratings across and lines from top to bottom."""
    axes.set_ylim(rows - 0.5, -0.5)
    axes.grid(axis="x", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)


def interval_ticks(intervals: Iterable[Interval], ratings: Sequence[float] = ()) -> list[float]:
    """Return the ticks of an axis that covers intervals and ratings; none without an interval."""
    ends = [
        value
        for lower, middle, upper in intervals
        if lower is not None or upper is not None
        for value in (lower, middle, upper)
        if value is not None
    ]
    return round_ticks(min([*ends, *ratings]), max([*ends, *ratings])) if ends else []


def round_ticks(low: float, high: float) -> list[float]:
    """Return round numbers that enclose low..high, at most MOST_TICKS steps apart."""
    span = max(high - low, 1e-9 if high > low else 1.0)
    power = 10.0 ** math.floor(math.log10(span / MOST_TICKS))
    step = next(power * f for f in (1, 2, 5, 10) if span / (power * f) <= MOST_TICKS)
    first, last = math.floor(low / step), math.ceil(high / step)
    return [step * n for n in range(first, max(last, first + 1) + 1)]
