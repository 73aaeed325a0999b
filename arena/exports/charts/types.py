"""The ratings of every scenario type beside each other, for papers, drawn by matplotlib."""

from __future__ import annotations

import math
from collections.abc import Sequence

from arena.exports.charts.drawing import INK, SIMULATED, house_style, width_in, write_figure
from arena.exports.charts.intervals import draw_interval, rating_axis
from arena.exports.tables import LeaderboardTable
from arena.rating.snapshot_document import TypeRating

_PANEL_IN, _ROW_IN, _MOST_ACROSS = 2.1, 0.26, 3
_BETWEEN_IN, _FOOT_IN = 0.6, 0.15
_NAME_PT = 7.0


def type_charts(
    parts: Sequence[TypeRating], table: LeaderboardTable, *, file_format: str
) -> bytes:
    """A panel a type on one axis, contestants in the order of the whole table.

    Args:
        parts: As a snapshot keeps them.
        table: Whose lines they are.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.figure import Figure

    rows = table.rows
    across = min(len(parts), _MOST_ACROSS)
    down = math.ceil(len(parts) / across)
    with house_style():
        names = max((width_in(row.model, _NAME_PT) for row in rows), default=0.0) + 0.2
        plot = _ROW_IN * len(rows)
        wide, high = names + _PANEL_IN * across, (plot + _BETWEEN_IN) * down + _FOOT_IN
        figure = Figure(figsize=(wide, high))
        panels = list(figure.subplots(down, across, sharex=True, squeeze=False).flat)
        figure.subplots_adjust(
            left=names / wide,
            right=1.0 - 0.1 / wide,
            top=1.0 - 0.25 / high,
            bottom=(_FOOT_IN + 0.25) / high,
            wspace=0.08,
            hspace=_BETWEEN_IN / plot,
        )
        for number, (panel, part) in enumerate(zip(panels, parts, strict=False)):
            by_slug = {line.slug: line for line in part.lines}
            for place, row in enumerate(rows):
                line = by_slug.get(row.slug)
                if line is not None:
                    interval = (line.lower, line.rating, line.upper)
                    draw_interval(panel, place, interval, simulated=row.simulated)
            panel.set_title(f"{part.label} (n {part.votes})", fontsize=7, color=INK)
            labels = ["" if number % across else row.model for row in rows]
            panel.set_yticks(range(len(rows)), labels, fontsize=_NAME_PT)
            for label, row in zip(panel.get_yticklabels(), rows, strict=True):
                label.set_color(SIMULATED if row.simulated else INK)
            panel.tick_params(axis="x", labelsize=7, labelbottom=True)
            rating_axis(panel, len(rows))
        for panel in panels[len(parts) :]:
            panel.set_visible(False)
        figure.text(
            0.5, 0.08 / high, "Elo with 95 % intervals, each type rated by itself", ha="center",
            fontsize=8, color=INK,
        )  # fmt: skip
        return write_figure(figure, file_format)
