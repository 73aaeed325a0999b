"""Displacement errors as box plots for papers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from arena.jobs.exports.displacement import SOURCE, DisplacementTable, PublishedBox
from arena.results.exports.drawing import (
    GRID,
    INK,
    MARK,
    SIMULATED,
    SOFT,
    house_style,
    write_figure,
)
from arena.results.exports.tables import shown_name
from augment.services.judging.displacement import VARIANTS, By, Group

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAR = 4.0
"""Values this many times beyond the longest whisker make the axis logarithmic."""
LINEAR_UP_TO_M = 1.0

_PAPER = "#8a939c"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartLine:
    """One line of the chart, from top to bottom: a heading, or a box with its name.

    Attributes:
        stats: As matplotlib's bxp takes them; None for a heading, or where nothing is matched.
    """

    label: str
    note: str = ""
    stats: dict[str, Any] | None = None
    colour: str = INK
    is_heading: bool = False


def box_plot(table: DisplacementTable, *, file_format: str) -> bytes:
    """A box a group: quartiles, median, Tukey's whiskers, outliers as rings, mean as a diamond.

    Published boxes stand grey and hatched under the heading of their variant.
    """
    from matplotlib.figure import Figure

    lines = list(_lines(table))
    with house_style():
        height = 1.4 + 0.27 * max(len(lines), 1)
        figure = Figure(figsize=(7.2, height), layout="constrained")
        axes = figure.add_subplot()
        for place, line in enumerate(lines):
            if line.stats is not None:
                _draw_box(axes, line, place)
        _name_lines(axes, lines)
        is_log = _scale(axes, [line.stats for line in lines if line.stats])
        axes.set_xlabel(_caption(table, is_log), color=INK, fontsize=8)
        return write_figure(figure, file_format)


# --- Private -----------------------------------------------------------------------------------


def _lines(table: DisplacementTable) -> Iterator[ChartLine]:
    if table.by is By.CONTESTANT:
        yield from map(_measured, table.groups)
        return
    headings = [box.variant for box in table.published] + [row.heading for row in table.groups]
    names = [name for name in VARIANTS if name in headings]
    for name in dict.fromkeys([*names, *(group.heading for group in table.groups)]):
        yield ChartLine(label=name, is_heading=True)
        yield from (_measured(group) for group in table.groups if group.heading == name)
        yield from (_published(box) for box in table.published if box.variant == name)


def _measured(group: Group) -> ChartLine:
    summary = group.summary
    notes = {"missing": summary.missing, "surplus": summary.surplus}
    counts = [f"{number} {word}" for word, number in notes.items() if number]
    box = summary.box
    return ChartLine(
        label=shown_name(group.contestant, group.is_simulated),
        note=", ".join([f"n {summary.n}", *counts]),
        stats=None
        if box is None
        else {
            "med": box.median_m,
            "q1": box.q1_m,
            "q3": box.q3_m,
            "whislo": box.low_m,
            "whishi": box.high_m,
            "mean": box.mean_m,
            "fliers": list(box.outliers_m),
        },
        colour=SIMULATED if group.is_simulated else MARK,
    )


def _published(box: PublishedBox) -> ChartLine:
    stats = {
        "med": box.median_m,
        "q1": box.q1_m,
        "q3": box.q3_m,
        "whislo": box.q1_m,  # the figure does not show it
        "whishi": box.high_m,
        "fliers": [],
    }
    return ChartLine(label=f"{box.model} (paper)", stats=stats, colour=_PAPER)


def _draw_box(axes: Axes, line: ChartLine, place: int) -> None:
    colour, is_paper = line.colour, line.colour == _PAPER
    pen = {"color": colour, "linewidth": 1.1}
    axes.bxp(
        [line.stats or {}],
        positions=[place],
        widths=0.56,
        orientation="horizontal",
        manage_ticks=False,
        patch_artist=True,
        showmeans=not is_paper,
        boxprops={
            "facecolor": "white" if is_paper else f"{colour}33",
            "edgecolor": colour,
            "linewidth": 1.1,
            "hatch": "////" if is_paper else "",
        },
        whiskerprops=pen,
        capprops=pen,
        medianprops={"color": colour, "linewidth": 2.2},
        meanprops={
            "marker": "D",
            "markersize": 3.5,
            "markerfacecolor": "white",
            "markeredgecolor": colour,
        },
        flierprops={"marker": "o", "markersize": 3.2, "markeredgecolor": colour},
    )


def _name_lines(axes: Axes, lines: Sequence[ChartLine]) -> None:
    """Write names to the left, counts to the right, headings in bold."""
    axes.set_yticks(range(len(lines)), [line.label for line in lines], fontsize=8)
    for place, (label, line) in enumerate(zip(axes.get_yticklabels(), lines, strict=True)):
        label.set_color(line.colour if line.colour == SIMULATED else INK)
        label.set_fontweight("bold" if line.is_heading else "normal")
        beside = ("axes fraction", "data")
        axes.annotate(
            line.note, (1.01, place), xycoords=beside, va="center", fontsize=7, color=SOFT
        )
    axes.set_ylim(max(len(lines), 1) - 0.4, -0.6)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _scale(axes: Axes, boxes: Sequence[dict[str, Any]]) -> bool:
    """Scale the axis linearly, or logarithmically where outliers would squeeze all boxes.

    Returns:
        Whether it is logarithmic, from the first metre on.
    """
    longest = max([LINEAR_UP_TO_M, *(box["whishi"] for box in boxes)])
    outliers = [outlier for box in boxes for outlier in box["fliers"]]
    furthest = max([longest, *outliers, *(box.get("mean", 0.0) for box in boxes)])
    is_log = bool(max([0.0, *outliers]) > FAR * longest)
    if is_log:
        axes.set_xscale("symlog", linthresh=LINEAR_UP_TO_M, linscale=1.0)
        marks = (0, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)
        ticks = [tick for tick in marks if tick <= furthest]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=8)
        axes.minorticks_off()
        axes.set_xlim(-0.03, furthest * 1.25)
    else:
        axes.tick_params(axis="x", labelsize=8)
        axes.set_xlim(-0.01 * furthest, furthest * 1.05)
    axes.grid(axis="x", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    return is_log


def _caption(table: DisplacementTable, is_log: bool) -> str:
    simulated = ", with simulated contestants" if table.simulated else ""
    lines = [
        f"Displacement error (m){simulated}" + ("; logarithmic beyond 1 m" if is_log else ""),
        table.types_text,
        "Boxes: quartiles around the median; whiskers: up to 1.5 boxes; diamonds: means",
    ]
    if table.published:
        lines.append(f"Grey, hatched: {SOURCE}, without its outliers")
    return "\n".join(lines)
