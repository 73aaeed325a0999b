"""A job's augmentations with one row each, and what varies between its samples."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from typing import Any

from arena.exports.formats import Format, formats, round_value
from arena.exports.parquet import NUMBER, TEXT, WHOLE, YES_NO, parquet_bytes
from arena.services.cells import cell
from augment.models import GenerationJob
from augment.services.judging.analyses import (
    AugmentationLine,
    RepeatLine,
    SampleSpread,
    augmentation_lines,
    repeatability,
)

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
