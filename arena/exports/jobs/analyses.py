"""What a job says about its contestants beside displacement, as files: one part a file.

The same job always gives the same bytes: the bootstrap has a seed, which the file names.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from dataclasses import dataclass

from arena.exports.formats import Format, formats
from arena.services.cells import cell
from augment.services.judging.analyses import JobAnalysis

Rows = list[dict[str, object]]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisTable:
    """One part of a job's analysis as rows of named values."""

    part: str
    columns: tuple[str, ...]
    rows: Rows
    seed: int


def analysis_table(analysis: JobAnalysis, part: str) -> AnalysisTable:
    """The rows of a part: one of `PARTS`."""
    columns, rows = PARTS[part]
    return AnalysisTable(part=part, columns=columns, rows=rows(analysis), seed=analysis.seed)


def csv_bytes(table: AnalysisTable) -> bytes:
    """One line a row; what is unknown is empty."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([_cell(row[name]) for name in table.columns] for row in table.rows)
    return sheet.getvalue().encode()


def json_bytes(table: AnalysisTable) -> bytes:
    """The same rows as objects."""
    document = {
        "format": "scenario-arena/analysis",
        "version": 1,
        "part": table.part,
        "seed": table.seed,
        "rows": table.rows,
    }
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


ANALYSIS_FORMATS: dict[str, Format[AnalysisTable]] = formats(csv=csv_bytes, json=json_bytes)


# Private


def _pairs(analysis: JobAnalysis) -> Rows:
    return [
        {
            "first": one.first,
            "second": one.second,
            "scenarios": one.scenarios,
            "median_difference_m": _rounded(one.median_m),
            "low_m": _rounded(one.low_m),
            "high_m": _rounded(one.high_m),
            "p_wilcoxon": _rounded(one.p, 6),
            "p_holm": _rounded(one.p_holm, 6),
        }
        for one in analysis.pairs
    ]


def _wordings(analysis: JobAnalysis) -> Rows:
    return [
        {
            "contestant": one.slug,
            "simulated": one.is_simulated,
            "scenarios": one.robustness.scenarios,
            "wordings": one.robustness.wordings,
            "within_m": _rounded(one.robustness.within_m),
            "median_range_m": _rounded(one.robustness.median_range_m),
        }
        for one in analysis.contestants
        if one.robustness is not None
    ]


def _refusals(analysis: JobAnalysis) -> Rows:
    return [
        {
            "contestant": one.slug,
            "simulated": one.is_simulated,
            "right": one.refusals.right,
            "wrong": one.refusals.wrong,
            "overlooked": one.refusals.overlooked,
            "precision": _rounded(one.refusals.precision),
            "recall": _rounded(one.refusals.recall),
        }
        for one in analysis.contestants
        if one.refusals is not None
    ]


def _cell(value: object) -> str:
    """A text is no formula, and a number may be negative."""
    return f"{value:g}" if isinstance(value, float) else cell(value)


def _rounded(value: float | None, digits: int = 4) -> float | None:
    return None if value is None else round(value, digits) + 0.0


PARTS: dict[str, tuple[tuple[str, ...], Callable[[JobAnalysis], Rows]]] = {
    "pairs": (
        (
            "first", "second", "scenarios", "median_difference_m", "low_m", "high_m",
            "p_wilcoxon", "p_holm",
        ),
        _pairs,
    ),
    "wordings": (
        ("contestant", "simulated", "scenarios", "wordings", "within_m", "median_range_m"),
        _wordings,
    ),
    "refusals": (
        ("contestant", "simulated", "right", "wrong", "overlooked", "precision", "recall"),
        _refusals,
    ),
}  # fmt: skip
"""The columns of each part, and how its rows are made."""
