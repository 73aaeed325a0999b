"""Who scored what against whom, for papers, drawn by matplotlib."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from arena.exports.charts.drawing import INK, SIMULATED, SOFT, house_style, width_in, write_figure
from arena.exports.charts.heat_map import STRONG, heat_map
from arena.exports.tables import Row
from arena.rating.snapshot_document import PairRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CELL_IN, _FOOT_IN, _FEWEST_IN = 0.62, 0.5, 3.9
_NAME_PT = 8.0
_COLOURS = ("#f0a15c", "#f7f8f8", "#6aa5db")
"""Orange for the column, blue for the row: told apart with any colour vision."""


def heat_chart(rows: Sequence[Row], pairs: Sequence[PairRecord], *, file_format: str) -> bytes:
    """Percent and number of votes in every cell, contestants in the given order.

    Args:
        rows: The contestants.
        pairs: As a snapshot keeps them.
        file_format: "svg", "pdf" or "png".
    """
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    lines = heat_map(pairs, rows)
    numbers = [str(n) for n in range(1, len(rows) + 1)]
    with house_style():
        names_in = max((width_in(row.model, _NAME_PT) for row in rows), default=0.0) + 0.45
        side = _CELL_IN * max(len(rows), 2)
        wide, high = max(names_in + side, _FEWEST_IN) + 0.1, side + _FOOT_IN + 0.1
        figure = Figure(figsize=(wide, high))
        axes = figure.add_axes((names_in / wide, _FOOT_IN / high, side / wide, side / high))
        colours = LinearSegmentedColormap.from_list("score", _COLOURS)
        shares = [
            [math.nan if cell is None or cell.share is None else cell.share for cell in line.cells]
            for line in lines
        ]
        axes.imshow(shares, cmap=colours, vmin=0.5 - STRONG, vmax=0.5 + STRONG)
        for i, line in enumerate(lines):
            for j, cell in enumerate(line.cells):
                if cell is not None and cell.votes:
                    _write(axes, f"{cell.percent}", j, i - 0.12, 9.0)
                    _write(axes, f"{cell.votes}", j, i + 0.24, 6.5)
        axes.set_yticks(range(len(rows)), numbers, fontsize=8)
        axes.set_xticks(range(len(rows)), numbers, fontsize=8)
        for place, row in enumerate(rows):
            axes.annotate(
                row.model, (0.0, place), (-18.0, 0.0), ("axes fraction", "data"),
                "offset points", ha="right", va="center", fontsize=_NAME_PT,
                color=SIMULATED if row.simulated else INK,
            )  # fmt: skip
        axes.tick_params(length=0, colors=INK)
        axes.spines[:].set_visible(False)
        figure.text(
            0.99, 0.08 / high, "Score of the row in percent, a tie half a win; votes beneath",
            ha="right", color=SOFT, fontsize=7.5,
        )  # fmt: skip
        return write_figure(figure, file_format)


def _write(axes: Axes, text: str, x: float, y: float, size: float) -> None:
    """Inside a cell; ink keeps a contrast of 4.5 on every colour."""
    axes.text(x, y, text, ha="center", va="center", fontsize=size, color=INK)
