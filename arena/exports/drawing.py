"""Shared parts of all charts: their style, intervals, and files with reproducible bytes."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial, wraps
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from django.contrib.staticfiles import finders

from augment.services.judging import compute_once, digest_code

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT, GRID, MARK, SIMULATED = "#1d2733", "#5b6773", "#d5dbe3", "#2f6db5", "#7a4fae"
DPI = 200
_PAGE_COLOURS = {
    **{INK: "ink", "#000000": "ink", SOFT: "ink-soft", GRID: "line", "#ffffff": "surface"},
    **{MARK: "accent", SIMULATED: "simulated", "#2c7a4b": "good", "#a35a00": "warn"},
}
"""Variables of the pages' colours, by the colour of a chart."""

_DIM = "@media (prefers-color-scheme: dark) { image { opacity: 0.28; } }"
"""In the dark a heat map, a picture within the chart, has to stay behind its numbers."""

Interval = tuple[float | None, float | None, float | None]
"""Lower bound, rating, upper bound."""

NO_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
"""No date, random id or version may get into a file, so that its bytes never differ."""

_STYLE: dict[Any, Any] = {
    "svg.hashsalt": "scenario-arena",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,  # publishers refuse Type 3, matplotlib's default
    "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    "font.size": 8.0,
    **{f"{name}.color": INK for name in ("text", "xtick", "ytick")},
    "axes.labelcolor": INK,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    **{f"axes.spines.{side}": False for side in ("top", "right", "left")},
    "ytick.major.size": 0.0,
}
_LOCK = Lock()
_CODE = tuple(sorted(Path(__file__).parents[1].glob("**/exports")))
"""What decides how a chart looks."""


def draw_once(
    draw: Callable[..., bytes], content: Callable[..., object] = lambda *parts: parts
) -> Callable[..., bytes]:
    """Return the same chart, which a file keeps for as long as content and code are the same.

    Args:
        draw: Takes `file_format` and what is drawn.
        content: Returns that as plain values, whose `repr` says all of it.
    """

    @wraps(draw)
    def draw_or_read(*parts: Any, file_format: str) -> bytes:
        code = digest_code(*_CODE)
        key = draw.__name__, code, version("matplotlib"), content(*parts)
        return compute_once(file_format, partial(draw, *parts, file_format=file_format), *key)

    return draw_or_read


def recolour(svg: bytes) -> bytes:
    """Return a chart in the colours of the pages, light or dark as the page that shows through."""
    tokens, _, _ = Path(str(finders.find("css/tokens.css"))).read_text().partition("\n}")
    text = svg.decode().replace('style="fill: #ffffff"', 'style="fill: none"')
    for colour, name in _PAGE_COLOURS.items():
        text = text.replace(colour, f"var(--{name})")
    style = f"<style>{tokens}\n}}{_DIM}</style>"
    return re.sub(r"<svg[^>]*>", lambda tag: tag[0] + style, text, count=1).encode()


@contextmanager
def chart_style() -> Iterator[None]:
    """Apply the settings of matplotlib under which every chart is drawn, one chart at a time.

    The settings belong to the whole process, so threads of the web server have to take turns.
    """
    import matplotlib

    with _LOCK, matplotlib.rc_context(_STYLE):
        yield


def write_figure(figure: Figure, file_format: str) -> bytes:
    """Return the bytes of an "svg", "pdf" or "png" file; call it within `chart_style`."""
    picture = io.BytesIO()
    figure.savefig(picture, format=file_format, dpi=DPI, metadata=NO_METADATA[file_format])
    return picture.getvalue()


def name_lines(axes: Axes, names: Sequence[str], simulated: Sequence[bool]) -> None:
    """Name the lines of a chart from top to bottom, simulated ones in their colour."""
    axes.set_yticks(range(len(names)), names)
    for label, is_simulated in zip(axes.get_yticklabels(), simulated, strict=False):
        label.set_color(SIMULATED if is_simulated else INK)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(axis="x")


def draw_interval(
    axes: Axes,
    place: float,
    interval: Interval,
    *,
    simulated: bool,
    colour: str = MARK,
    upright: bool = False,
    label: str = "",
) -> None:
    """Draw a mark at the rating and a bar over the interval, with an arrow where it is open.

    Args:
        axes: Where to draw.
        place: The line of the chart; across with `upright`.
        interval: Nothing is drawn if all of it is unknown; a bound alone begins with a stroke.
        simulated: Whether it is a diamond in a colour of its own.
        colour: Of the others.
        upright: Whether the bar stands.
        label: Of the mark, in a key.
    """
    present = [value for value in interval if value is not None]
    if not present:
        return
    lower, middle, upper = interval
    colour, shape = (SIMULATED, "D") if simulated else (colour, "o")

    def at(value: float) -> tuple[float, float]:
        return (place, value) if upright else (value, place)

    ends = zip(at(present[0]), at(present[-1]), strict=True)
    axes.plot(*ends, color=colour, linewidth=1.6)
    if middle is None:
        shape, middle = "_" if upright else "|", present[0]
    look: dict[str, Any] = {"marker": shape, "markersize": 5, "linestyle": "", "color": colour}
    axes.plot(*zip(at(middle), strict=True), label=label or None, **look)
    if (lower is None) != (upper is None):
        start, edge = (present[0], 0.0) if lower is None else (present[-1], 1.0)
        to_edge = axes.get_xaxis_transform() if upright else axes.get_yaxis_transform()
        arrow = {"arrowstyle": "->", "color": colour, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", at(edge), at(start), to_edge, "data", arrowprops=arrow)
