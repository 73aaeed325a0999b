"""A job's augmentations with one row each, and what varies between its samples."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from arena.exports.formats import Format, formats, round_value
from arena.exports.parquet import NUMBER, TEXT, WHOLE, YES_NO, parquet_bytes
from arena.services.cells import cell, csv_text
from augment.models import GenerationJob
from augment.services.judging.analyses import (
    AugmentationLine,
    JobAnalysis,
    RepeatLine,
    SampleSpread,
    augmentation_lines,
    repeatability,
)
from augment.services.running.progress import ToolCallLine

COLUMNS = {
    "job": TEXT, "scenario": TEXT, "type": TEXT, "contestant": TEXT, "name": TEXT, "model": TEXT,
    "variant": TEXT, "simulated": YES_NO, "sample": WHOLE, "options": TEXT,
    "augmentation": TEXT, "state": TEXT, "matched": WHOLE, "missing": WHOLE, "surplus": WHOLE,
    "displacement_mean_m": NUMBER, "wrong": WHOLE, "doubtful": WHOLE, "calls": WHOLE,
    "tokens": WHOLE, "cost_usd": NUMBER, "reason": TEXT,
}  # fmt: skip
"""What each column holds. `contestant` is the slug, `options` a JSON object with sorted names,
`wrong` and `doubtful` count findings of the checks; what is unknown or does not exist is empty."""

MEASURES = ("displacement_m", "missed", "usd", "wrong")
REPEAT_COLUMNS = (
    "contestant", "name", "simulated", "samples", *(
        f"{name}_{part}" for name in MEASURES for part in ("mean", "sd", "values")
    ), "displacement_within_scenario_sd_m",
)  # fmt: skip
"""`sd` is between samples, `values` has one number a sample; see `RepeatLine`."""

Rows = list[tuple[object, ...]]


def augmentation_rows(job: GenerationJob) -> Rows:
    """One row an augmentation, in the order of COLUMNS."""
    return [_row(job, line) for line in augmentation_lines(job)]


def repeat_rows(job: GenerationJob) -> Rows:
    """One row a contestant, in the order of REPEAT_COLUMNS."""
    return [_repeat_row(line) for line in repeatability(job)]


def csv_bytes(head: Sequence[str], rows: Rows) -> bytes:
    """One line a row; a text is no formula, and a number is written in full."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(
        [value if isinstance(value, float) else cell(value) for value in row] for row in rows
    )
    return sheet.getvalue().encode()


def json_bytes(name: str, head: Sequence[str], rows: Rows) -> bytes:
    """A list of objects with the same names."""
    document = {
        "format": f"scenario-arena/{name}",
        "version": 1,
        name: [dict(zip(head, row, strict=True)) for row in rows],
    }
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


AUGMENTATION_FORMATS: dict[str, Format[Rows]] = formats(
    csv=lambda rows: csv_bytes(tuple(COLUMNS), rows),
    json=lambda rows: json_bytes("augmentations", tuple(COLUMNS), rows),
    parquet=lambda rows: parquet_bytes(COLUMNS, rows),
)
REPEAT_FORMATS: dict[str, Format[Rows]] = formats(
    csv=lambda rows: csv_bytes(REPEAT_COLUMNS, rows),
    json=lambda rows: json_bytes("repeats", REPEAT_COLUMNS, rows),
)


# Private


def _row(job: GenerationJob, line: AugmentationLine) -> tuple[object, ...]:
    row, who, found, spent = line.row, line.row.contestant, line.displacement, line.spending
    distances = [] if found is None else found.distances_m
    mean = round_value(sum(distances) / len(distances)) if distances else None
    options = None if row.options is None else json.dumps(row.options, sort_keys=True)
    usd = None if spent is None else spent.usd
    return (
        *(job.name, row.scenario.slug, row.scenario.type, who.slug, who.name, who.model),
        *(who.variant, who.is_simulated, row.sample, options, str(row.code), row.state),
        None if found is None else len(distances),
        None if found is None else len(found.missing),
        None if found is None else len(found.surplus),
        mean,
        *(line.wrong, line.doubtful),
        *((None, None) if spent is None else (spent.calls, spent.tokens)),
        *(usd, row.reason),
    )


def _repeat_row(line: RepeatLine) -> tuple[object, ...]:
    spreads: list[SampleSpread | None] = [getattr(line, name) for name in MEASURES]
    samples = max((len(one.values) for one in spreads if one is not None), default=0)
    return (
        *(line.slug, line.name, line.is_simulated, samples),
        *(part for one in spreads for part in _parts(one)),
        round_value(line.within_m),
    )


def _parts(spread: SampleSpread | None) -> tuple[Any, Any, Any]:
    if spread is None:
        return None, None, None
    values = " ".join(f"{value:.6g}" for value in spread.values)
    return round(spread.mean, 6), None if spread.sd is None else round(spread.sd, 6), values


AnalysisRows = list[dict[str, object]]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisTable:
    """One part of a job's analysis as rows of named values."""

    part: str
    columns: tuple[str, ...]
    rows: AnalysisRows
    seed: int


def analysis_table(analysis: JobAnalysis, part: str) -> AnalysisTable:
    """The rows of a part: one of `PARTS`."""
    columns, rows = PARTS[part]
    return AnalysisTable(part=part, columns=columns, rows=rows(analysis), seed=analysis.seed)


def analysis_csv(table: AnalysisTable) -> bytes:
    """One line a row; what is unknown is empty."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([_cell(row[name]) for name in table.columns] for row in table.rows)
    return sheet.getvalue().encode()


def analysis_json(table: AnalysisTable) -> bytes:
    """The same rows as objects."""
    document = {
        "format": "scenario-arena/analysis",
        "version": 1,
        "part": table.part,
        "seed": table.seed,
        "rows": table.rows,
    }
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


ANALYSIS_FORMATS: dict[str, Format[AnalysisTable]] = formats(csv=analysis_csv, json=analysis_json)


# Private


def _pairs(analysis: JobAnalysis) -> AnalysisRows:
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


def _wordings(analysis: JobAnalysis) -> AnalysisRows:
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


def _refusals(analysis: JobAnalysis) -> AnalysisRows:
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


PARTS: dict[str, tuple[tuple[str, ...], Callable[[JobAnalysis], AnalysisRows]]] = {
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


CALL_COLUMNS = (
    "contestant", "name", "simulated", "scenario", "augmentation", "attempted", "understood",
    "mended",
)  # fmt: skip
"""One row an augmentation that called; `contestant` is the slug, `augmentation` the code."""

Lines = list[ToolCallLine]


def call_csv(lines: Lines) -> bytes:
    """One row an augmentation."""
    return csv_text(CALL_COLUMNS, [_row_tool_calls(line) for line in lines]).encode()


def call_json(lines: Lines) -> bytes:
    """The same as a list of objects."""
    document = {
        "format": "scenario-arena/tool-calls",
        "version": 1,
        "augmentations": [
            dict(zip(CALL_COLUMNS, _row_tool_calls(line), strict=True)) for line in lines
        ],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


CALL_FORMATS: dict[str, Format[Lines]] = formats(csv=call_csv, json=call_json)


# Private


def _row_tool_calls(line: ToolCallLine) -> tuple[object, ...]:
    return (
        line.contestant, line.name, line.is_simulated, line.scenario, line.augmentation,
        line.attempted, line.understood, line.mended,
    )  # fmt: skip
