"""Displacement errors as box plots for papers, drawn by matplotlib."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

from arena.exports.charts.drawing import (
    GRID,
    INK,
    MARK,
    SIMULATED,
    SOFT,
    house_style,
    write_figure,
)
from arena.exports.tables import shown_name
from arena.jobs.exports.displacement import SOURCE, DisplacementTable, PublishedBox
from augment.services.judging.displacement import VARIANTS, By, Group

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAR = 4.0
"""Values this many times beyond the longest whisker squeeze all boxes: the axis turns
logarithmic from the first metre on."""
LINEAR_UP_TO_M = 1.0

_ROW_IN = 0.27
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
    is_paper: bool = False


def box_plot(table: DisplacementTable, *, file_format: str) -> bytes:
    """A box a group: quartiles, median, Tukey's whiskers, outliers as rings, mean as a diamond.

    Args:
        table: Published boxes stand grey and hatched under the heading of their variant.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.figure import Figure

    lines = list(_lines(table))
    with house_style():
        height = 1.4 + _ROW_IN * max(len(lines), 1)
        figure = Figure(figsize=(7.2, height), layout="constrained")
        axes = figure.add_subplot()
        for place, line in enumerate(lines):
            _draw(axes, line, place)
        _rows(axes, lines)
        _scale(axes, lines)
        axes.set_xlabel(_caption(table), color=INK, fontsize=8)
        return write_figure(figure, file_format)


def is_far(lines: list[ChartLine]) -> bool:
    """Whether outliers lie so far out that a linear axis would show little else."""
    whiskers: list[float] = [line.stats["whishi"] for line in lines if line.stats]
    outliers: list[float] = [stat for line in lines if line.stats for stat in line.stats["fliers"]]
    longest = max([*whiskers, LINEAR_UP_TO_M])
    return max([*outliers, 0.0]) > FAR * longest


# Private


def _lines(table: DisplacementTable) -> Iterator[ChartLine]:
    if table.by is By.CONTESTANT:
        yield from (_measured(group) for group in table.groups)
        return
    published = {name: list(boxes) for name, boxes in groupby(table.published, _variant)}
    groups_by_heading = {name: list(some) for name, some in groupby(table.groups, _heading)}
    names = [*(name for name in VARIANTS if name in published or name in groups_by_heading)]
    names += [name for name in groups_by_heading if name not in names]
    for name in names:
        yield ChartLine(label=name, is_heading=True)
        yield from (_measured(group) for group in groups_by_heading.get(name, ()))
        yield from (_from_paper(box) for box in published.get(name, ()))


def _heading(group: Group) -> str:
    return group.heading


def _variant(box: PublishedBox) -> str:
    return box.variant


def _measured(group: Group) -> ChartLine:
    summary = group.summary
    note = f"n {summary.n}"
    if summary.missing:
        note += f", {summary.missing} missing"
    if summary.surplus:
        note += f", {summary.surplus} surplus"
    colour = SIMULATED if group.is_simulated else MARK
    if summary.box is None:
        return ChartLine(
            label=shown_name(group.contestant, group.is_simulated), note=note, colour=colour
        )
    box = summary.box
    stats = {
        "med": box.median_m,
        "q1": box.q1_m,
        "q3": box.q3_m,
        "whislo": box.low_m,
        "whishi": box.high_m,
        "mean": box.mean_m,
        "fliers": list(box.outliers_m),
    }
    return ChartLine(
        label=shown_name(group.contestant, group.is_simulated),
        note=note,
        stats=stats,
        colour=colour,
    )


def _from_paper(box: PublishedBox) -> ChartLine:
    stats = {
        "med": box.median_m,
        "q1": box.q1_m,
        "q3": box.q3_m,
        "whislo": box.q1_m,  # the figure does not show it
        "whishi": box.high_m,
        "fliers": [],
    }
    label = f"{box.model} (paper)"
    return ChartLine(label=label, stats=stats, colour=_PAPER, is_paper=True)


def _draw(axes: Axes, line: ChartLine, place: int) -> None:
    if line.stats is None:
        return
    pen = {"color": line.colour, "linewidth": 1.1}
    axes.bxp(
        [line.stats],
        positions=[place],
        widths=0.56,
        orientation="horizontal",
        manage_ticks=False,
        patch_artist=True,
        showmeans="mean" in line.stats,
        boxprops={
            "facecolor": "white" if line.is_paper else f"{line.colour}33",
            "edgecolor": line.colour,
            "linewidth": 1.1,
            "hatch": "////" if line.is_paper else "",
        },
        whiskerprops=pen,
        capprops=pen,
        medianprops={"color": line.colour, "linewidth": 2.2},
        meanprops={
            "marker": "D",
            "markersize": 3.5,
            "markerfacecolor": "white",
            "markeredgecolor": line.colour,
        },
        flierprops={"marker": "o", "markersize": 3.2, "markeredgecolor": line.colour},
    )


def _rows(axes: Axes, lines: list[ChartLine]) -> None:
    """Names to the left, counts to the right, headings in bold."""
    axes.set_yticks(range(len(lines)), [line.label for line in lines], fontsize=8)
    for label, line in zip(axes.get_yticklabels(), lines, strict=True):
        label.set_color(line.colour if line.colour == SIMULATED else INK)
        label.set_fontweight("bold" if line.is_heading else "normal")
    for place, line in enumerate(lines):
        axes.annotate(
            line.note,
            (1.01, place),
            xycoords=("axes fraction", "data"),
            va="center",
            fontsize=7,
            color=SOFT,
        )
    axes.set_ylim(max(len(lines), 1) - 0.4, -0.6)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _scale(axes: Axes, lines: list[ChartLine]) -> None:
    """Linear from zero, or logarithmic from the first metre on where outliers need it."""
    ends = [one for line in lines if line.stats for one in _reach(line.stats)]
    furthest = max([*ends, LINEAR_UP_TO_M])
    if is_far(lines):
        axes.set_xscale("symlog", linthresh=LINEAR_UP_TO_M, linscale=1.0)
        ticks = [one for one in (0, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500) if one <= furthest]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=8)
        axes.minorticks_off()
        axes.set_xlim(-0.03, furthest * 1.25)
    else:
        axes.tick_params(axis="x", labelsize=8)
        axes.set_xlim(-0.01 * furthest, furthest * 1.05)
    axes.grid(axis="x", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _reach(stats: dict[str, Any]) -> list[float]:
    return [stats["whishi"], stats.get("mean", 0.0), *stats["fliers"]]


def _caption(table: DisplacementTable) -> str:
    lines = [
        "Displacement error (m)" + (", with simulated contestants" if table.simulated else "")
    ]
    if is_far(list(_lines(table))):
        lines[0] += "; logarithmic beyond 1 m"
    lines.append(table.types_text)
    lines.append("Boxes: quartiles around the median; whiskers: up to 1.5 boxes; diamonds: means")
    if table.published:
        lines.append(f"Grey, hatched: {SOURCE}, without its outliers")
    return "\n".join(lines)
