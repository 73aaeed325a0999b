"""The calls of a job's contestants to their function as a file: tried, understood, mended."""

from __future__ import annotations

import json

from arena.exports.formats import Format, formats
from arena.services.cells import csv_text
from augment.services.running.progress import ToolCallLine

COLUMNS = (
    "contestant", "name", "simulated", "scenario", "augmentation", "attempted", "understood",
    "mended",
)  # fmt: skip
"""One row an augmentation that called; `contestant` is the slug, `augmentation` the code."""

Lines = list[ToolCallLine]


def csv_bytes(lines: Lines) -> bytes:
    """One row an augmentation."""
    return csv_text(COLUMNS, [_row(line) for line in lines]).encode()


def json_bytes(lines: Lines) -> bytes:
    """The same as a list of objects."""
    document = {
        "format": "scenario-arena/tool-calls",
        "version": 1,
        "augmentations": [dict(zip(COLUMNS, _row(line), strict=True)) for line in lines],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


FORMATS: dict[str, Format[Lines]] = formats(csv=csv_bytes, json=json_bytes)


# Private


def _row(line: ToolCallLine) -> tuple[object, ...]:
    return (
        line.contestant, line.name, line.is_simulated, line.scenario, line.augmentation,
        line.attempted, line.understood, line.mended,
    )  # fmt: skip
