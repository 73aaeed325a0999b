"""A sweep as a table and as a chart of scores over values."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arena.exports.drawing import MARK, SOFT, chart_style, draw_once, write_figure
from arena.exports.formats import Columns, Dtype, Sheet, drawings, make_sheet, table_formats
from augment.services.driving import SweepResult, driver_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_KEPT = "#a35a00"
"""Colour of the value that was kept."""


def sweep_sheet(result: SweepResult) -> Sheet:
    """Return one row a drive, and one for a value that fits nowhere."""
    lines = [
        {"line": line, "drive": drive, "driver": drive and driver_name(drive), "lawful": is_lawful}
        for line in result.lines
        for drive, is_lawful in line.cells or [(None, None)]
    ]
    columns: Columns = {
        "value": ("line.row.value", Dtype.NUMBER),
        **Dtype.TEXT.columns("driver"),
        "state": ("drive.state", Dtype.TEXT),
        "nuplan_score": ("drive.nuplan_score", Dtype.NUMBER),
        **Dtype.YES_NO.columns("lawful"),
        "reason": ("drive.reason", Dtype.TEXT),
        "fits_nowhere": ("line.row.reason", Dtype.TEXT),
    }
    sweep = result.sweep
    facts = {
        "scenario": sweep.scenario.slug,
        "number": sweep.number,
        "tested": driver_name(sweep),
        "reactive": sweep.is_reactive,
        "verdict": result.verdict,
        "hardest_solved": None if result.hardest is None else result.hardest.value,
    }
    return make_sheet(lines, columns, name="sweep", digits=6, facts=facts)


def sweep_chart(result: SweepResult, *, file_format: str) -> bytes:
    """Draw the score over the values, a line a planner; a cross is a drive that fails."""
    from matplotlib.figure import Figure

    with chart_style():
        figure = Figure(figsize=(6.8, 3.4), layout="constrained")
        axes = figure.add_subplot()
        for good, bad in result.edges:
            axes.axvspan(min(good, bad), max(good, bad), color=MARK, alpha=0.15, linewidth=0)
        if result.hardest is not None:
            axes.axvline(result.hardest.value, color=_KEPT, label="hardest solved")
        tested = driver_name(result.sweep)
        others = [driver for driver in result.drivers if driver != tested]
        for driver, stroke in zip(others, ("--", ":", "-."), strict=False):
            _draw_curve(axes, result, driver, SOFT, stroke)
        _draw_curve(axes, result, tested, MARK, "-")
        axes.grid()
        low, high = result.lines[0].row.value, result.lines[-1].row.value
        margin = 0.03 * (high - low) or 1.0
        axes.set_xlim(low - margin, high + margin)
        axes.set_ylim(-4.0, 104.0)
        axes.set_xlabel(result.sweep.number)
        axes.set_ylabel("Score by nuPlan (%)")
        figure.legend(loc="outside right upper", frameon=False, fontsize=7)
        return write_figure(figure, file_format)


def _draw_curve(axes: Axes, result: SweepResult, driver: str, colour: str, stroke: str) -> None:
    trials = [
        (line.row.value, 100.0 * trial.score, trial.is_lawful)
        for line in result.lines
        for trial in line.trials
        if trial.driver == driver
    ]
    values, scores, lawful = np.array(trials, dtype=float).reshape(-1, 3).T
    axes.plot(values, scores, stroke, color=colour, linewidth=1.4, label=driver)
    for chosen, marker in ((lawful > 0.0, "o"), (lawful == 0.0, "x")):
        axes.plot(values[chosen], scores[chosen], marker, color=colour, markersize=5)


SWEEP_FORMATS = table_formats(sweep_sheet) | drawings(draw_once(sweep_chart, sweep_sheet))
