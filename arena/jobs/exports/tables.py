"""Tables of a job with one line a row, declared as columns; each is a CSV, JSON or Parquet file.

The same job always gives the same bytes. What is unknown or does not exist is empty.
"""

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any
from uuid import UUID

from arena.exports.cells import csv_text
from arena.exports.formats import NUMBER, TEXT, WHOLE, YES_NO, Format, formats, parquet_bytes
from augment.models import GenerationJob
from augment.services.judging.analyses import JobAnalysis, augmentation_lines, repeatability
from augment.services.judging.displacement import objects_of
from augment.services.running.progress import tool_calls

Value = str | Callable[[Any], object]
Columns = Mapping[str, tuple[Value, str]]
"""By name: a dotted path of attributes or a function of a line, and what the column holds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """Rows of named values.

    Attributes:
        name: JSON files say "scenario-arena/<name>".
        key: What the list of rows is called in JSON.
        number: The format of floats in CSV.
        facts: What else a JSON file says.
    """

    name: str
    key: str
    columns: Columns
    rows: list[tuple[object, ...]]
    number: str = ""
    facts: Mapping[str, object] = field(default_factory=dict)


def sheet_csv(sheet: Sheet) -> bytes:
    """Return one line a row; no text is a formula."""
    return csv_text(tuple(sheet.columns), sheet.rows, number=sheet.number).encode()


def sheet_json(sheet: Sheet) -> bytes:
    """Return the rows as objects."""
    document = {
        "format": f"scenario-arena/{sheet.name}",
        "version": 1,
        **sheet.facts,
        sheet.key: [dict(zip(sheet.columns, row, strict=True)) for row in sheet.rows],
    }
    return json_bytes(document)


def sheet_parquet(sheet: Sheet) -> bytes:
    """Return the rows as typed columns."""
    return parquet_bytes({name: kind for name, (_, kind) in sheet.columns.items()}, sheet.rows)


def json_bytes(document: object) -> bytes:
    """Return a document as an indented JSON file."""
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


TABLE_FORMATS: dict[str, Format[Sheet]] = formats(
    csv=sheet_csv, json=sheet_json, parquet=sheet_parquet
)


def read_columns(
    lines: Iterable[object], columns: Columns, *, digits: int
) -> list[tuple[object, ...]]:
    """Return a row of plain values for each line; floats are rounded to `digits` decimals."""
    return [
        tuple(read_value(line, value, digits=digits) for value, _ in columns.values())
        for line in lines
    ]


def read_value(line: Any, value: Value, *, digits: int = 4) -> object:
    """Return a plain value of a line; None where its path meets a None."""
    if callable(value):
        read = value(line)
    else:
        read = line
        for name in value.split("."):
            read = None if read is None else getattr(read, name)
    if isinstance(read, Enum):
        return read.value
    if isinstance(read, float):
        return round(read, digits) + 0.0
    if isinstance(read, tuple):
        return " ".join(f"{number:.6g}" for number in read)
    return str(read) if isinstance(read, UUID) else read


# --- The tables --------------------------------------------------------------------------------


def _count(name: str) -> Callable[[Any], int | None]:
    """Return what counts matched, missing or surplus objects of a line."""

    def count(line: Any) -> int | None:
        return None if line.displacement is None else len(getattr(line.displacement, name))

    return count


def _options(line: Any) -> str | None:
    options = line.row.options
    return None if options is None else json.dumps(options, sort_keys=True)


def _samples(line: Any) -> int:
    spreads = [getattr(line, name) for name in MEASURES]
    return max((len(spread.values) for spread in spreads if spread is not None), default=0)


_WHAT: Columns = {
    "scenario": ("row.scenario.slug", TEXT),
    "type": ("row.scenario.type", TEXT),
    "contestant": ("row.contestant.slug", TEXT),
    "name": ("row.contestant.name", TEXT),
    "model": ("row.contestant.model", TEXT),
    "variant": ("row.contestant.variant", TEXT),
    "simulated": ("row.contestant.is_simulated", YES_NO),
}
AUGMENTATIONS: Columns = {
    **_WHAT,
    "sample": ("row.sample", WHOLE),
    "options": (_options, TEXT),
    "augmentation": ("row.code", TEXT),
    "state": ("row.state", TEXT),
    "matched": (_count("matches"), WHOLE),
    "missing": (_count("missing"), WHOLE),
    "surplus": (_count("surplus"), WHOLE),
    "displacement_mean_m": ("displacement.mean_m", NUMBER),
    "wrong": ("wrong", WHOLE),
    "doubtful": ("doubtful", WHOLE),
    "calls": ("spending.calls", WHOLE),
    "tokens": ("spending.tokens", WHOLE),
    "cost_usd": ("spending.usd", NUMBER),
    "reason": ("row.reason", TEXT),
}
"""`contestant` is the slug, `options` a JSON object; `wrong` and `doubtful` count findings."""

OBJECTS: Columns = {
    **_WHAT,
    "augmentation": ("row.code", TEXT),
    "state": ("row.state", TEXT),
    "object": ("standing", TEXT),
    "class": ("object_class", TEXT),
    "reference": ("reference.id", TEXT),
    "reference_x_m": ("reference.x_m", NUMBER),
    "reference_y_m": ("reference.y_m", NUMBER),
    "generated": ("generated.id", TEXT),
    "x_m": ("generated.x_m", NUMBER),
    "y_m": ("generated.y_m", NUMBER),
    "distance_m": ("distance_m", NUMBER),
    "sample": ("row.sample", WHOLE),
}
"""`object` is matched, missing or surplus; places are in the ego frame."""

MEASURES = ("displacement_m", "missed", "usd")
REPEATS: Columns = {
    "contestant": ("slug", TEXT),
    "name": ("name", TEXT),
    "simulated": ("is_simulated", YES_NO),
    "samples": (_samples, WHOLE),
    **{
        f"{name}_{part}": (f"{name}.{part}", TEXT if part == "values" else NUMBER)
        for name in MEASURES
        for part in ("mean", "sd", "values")
    },
    "displacement_within_scenario_sd_m": ("within_m", NUMBER),
}
"""`sd` is between samples, `values` has one number a sample; see `RepeatLine`."""

TOOL_CALLS: Columns = {
    "contestant": ("contestant", TEXT),
    "name": ("name", TEXT),
    "simulated": ("is_simulated", YES_NO),
    "scenario": ("scenario", TEXT),
    "augmentation": ("augmentation", TEXT),
    "attempted": ("attempted", WHOLE),
    "understood": ("understood", WHOLE),
    "mended": ("mended", WHOLE),
}
_WHO: Columns = {"contestant": ("slug", TEXT), "simulated": ("is_simulated", YES_NO)}
ANALYSES: dict[str, tuple[str, Columns]] = {
    "pairs": (
        "pairs",
        {
            "first": ("first", TEXT),
            "second": ("second", TEXT),
            "scenarios": ("scenarios", WHOLE),
            "median_difference_m": ("median_m", NUMBER),
            "low_m": ("low_m", NUMBER),
            "high_m": ("high_m", NUMBER),
            "p_wilcoxon": ("p", NUMBER),
            "p_holm": ("p_holm", NUMBER),
        },
    ),
    "wordings": (
        "reworded",
        {
            **_WHO,
            "scenarios": ("robustness.scenarios", WHOLE),
            "wordings": ("robustness.wordings", WHOLE),
            "within_m": ("robustness.within_m", NUMBER),
        },
    ),
    "refusals": (
        "refusing",
        {
            **_WHO,
            "right": ("refusals.right", WHOLE),
            "wrong": ("refusals.wrong", WHOLE),
            "overlooked": ("refusals.overlooked", WHOLE),
            "precision": ("refusals.precision", NUMBER),
            "recall": ("refusals.recall", NUMBER),
        },
    ),
}
"""The parts of an analysis: the attribute that holds their lines, and their columns."""


def augmentation_sheet(job: GenerationJob) -> Sheet:
    """Return a job's augmentations with one row each."""
    columns: Columns = {"job": (lambda line: job.name, TEXT), **AUGMENTATIONS}
    rows = read_columns(augmentation_lines(job), columns, digits=4)
    return Sheet(name="augmentations", key="augmentations", columns=columns, rows=rows)


def object_sheet(job: GenerationJob, *, types: Collection[str] | None = None) -> Sheet:
    """Return the displacement of a job with one row an object.

    Args:
        job: Whose augmentations are measured.
        types: The scenario types that count; None for all.
    """
    found = objects_of(job)
    lines = (line for line in found if types is None or line.row.scenario.type in types)
    rows = read_columns(lines, OBJECTS, digits=4)
    return Sheet(
        name="displacement-objects", key="objects", columns=OBJECTS, rows=rows, number=".4f"
    )


def repeat_sheet(job: GenerationJob) -> Sheet:
    """Return what varies between the samples of a job, one row a contestant."""
    rows = read_columns(repeatability(job), REPEATS, digits=6)
    return Sheet(name="repeats", key="repeats", columns=REPEATS, rows=rows)


def tool_call_sheet(job: GenerationJob) -> Sheet:
    """Return the calls of a job's contestants to their function, one row an augmentation."""
    rows = read_columns(tool_calls(job), TOOL_CALLS, digits=4)
    return Sheet(name="tool-calls", key="augmentations", columns=TOOL_CALLS, rows=rows)


def analysis_sheet(analysis: JobAnalysis, part: str) -> Sheet:
    """Return one part of a job's analysis; its bootstrap has a seed, which JSON names."""
    attribute, columns = ANALYSES[part]
    rows = read_columns(getattr(analysis, attribute), columns, digits=6)
    facts = {"part": part, "seed": analysis.seed}
    return Sheet(name="analysis", key="rows", columns=columns, rows=rows, number="g", facts=facts)
