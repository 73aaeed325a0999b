"""Charts for papers, drawn by matplotlib; the pages draw their own."""

from __future__ import annotations

from arena.exports.drawing import GRID, INK, MARK, drawn, house_style
from arena.exports.tables import LeaderboardTable

_ROW_IN = 0.34


def interval_chart(table: LeaderboardTable, *, file_format: str) -> bytes:
    """The ratings as dots with their intervals as bars, best on top.

    Args:
        table: Contestants without a rating keep their line, without a dot.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=(6.4, 1.1 + _ROW_IN * len(table.rows)), layout="constrained")
        axes = figure.add_subplot()
        for place, row in enumerate(table.rows):
            if row.elo is None:
                continue
            if row.lower is not None and row.upper is not None:
                axes.plot([row.lower, row.upper], [place, place], color=MARK, linewidth=1.6)
            axes.plot([row.elo], [place], marker="o", markersize=5, color=MARK)
        axes.set_yticks(range(len(table.rows)), [row.model for row in table.rows])
        axes.set_ylim(len(table.rows) - 0.5, -0.5)
        axes.set_xlabel(_label(table), color=INK)
        axes.grid(axis="x", color=GRID, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.tick_params(axis="y", length=0, colors=INK)
        return drawn(figure, file_format)


def _label(table: LeaderboardTable) -> str:
    marks = [word for word, so in (("simulated", table.simulated), ("early", table.early)) if so]
    return "Elo with 95 % intervals" + (f" ({', '.join(marks)})" if marks else "")
