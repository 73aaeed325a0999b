"""Displacement with one row an object, for whoever wants to compute something else."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Collection, Sequence

from arena.exports.formats import Format, formats
from arena.exports.parquet import NUMBER, TEXT, WHOLE, YES_NO, parquet_bytes
from arena.services.cells import cell
from augment.models import GenerationJob
from augment.services.judging.displacement import DisplacedObject, ObjectPosition, objects_of

BY_OBJECT = "object"
"""How it is asked for, beside the groupings."""

COLUMNS = {
    "scenario": TEXT, "type": TEXT, "contestant": TEXT, "name": TEXT, "model": TEXT,
    "variant": TEXT, "simulated": YES_NO, "augmentation": TEXT, "state": TEXT, "object": TEXT,
    "class": TEXT, "reference": TEXT, "reference_x_m": NUMBER, "reference_y_m": NUMBER,
    "generated": TEXT, "x_m": NUMBER, "y_m": NUMBER, "distance_m": NUMBER, "sample": WHOLE,
}  # fmt: skip
"""What each column holds. `object` is matched, missing or surplus; `contestant` is the slug,
`augmentation` the code; places are in the ego frame; what does not exist is empty."""

Rows = list[tuple[object, ...]]


def object_rows(job: GenerationJob, *, types: Collection[str] | None = None) -> Rows:
    """One row an object, in the order of COLUMNS; numbers to the tenth of a millimetre.

    Args:
        job: Whose augmentations are measured.
        types: The scenario types that count; None for all five.
    """
    return [
        _row(one) for one in objects_of(job) if types is None or one.row.scenario.type in types
    ]


def csv_bytes(rows: Rows) -> bytes:
    """One line an object; a text is no formula, and a number may be negative."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return sheet.getvalue().encode()


def json_bytes(rows: Rows) -> bytes:
    """A list of objects with the same names."""
    document = {
        "format": "scenario-arena/displacement-objects",
        "version": 1,
        "objects": [dict(zip(COLUMNS, row, strict=True)) for row in rows],
    }
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


def parquet_of(rows: Rows) -> bytes:
    """The same columns, typed."""
    return parquet_bytes(COLUMNS, rows)


OBJECT_FORMATS: dict[str, Format[Rows]] = formats(
    csv=csv_bytes, json=json_bytes, parquet=parquet_of
)


# Private


def _row(one: DisplacedObject) -> tuple[object, ...]:
    row, contestant = one.row, one.row.contestant
    return (
        row.scenario.slug,
        row.scenario.type,
        contestant.slug,
        contestant.name,
        contestant.model,
        contestant.variant,
        contestant.is_simulated,
        str(row.code),
        row.state,
        one.standing.value,
        one.object_class.value,
        *_place(one.reference),
        *_place(one.generated),
        None if one.distance_m is None else round(one.distance_m, 4),
        row.sample,
    )


def _place(spot: ObjectPosition | None) -> Sequence[object]:
    if spot is None:
        return (None, None, None)
    return (spot.id, round(spot.x_m, 4), round(spot.y_m, 4))


def _cell(value: object) -> str:
    return f"{value:.4f}" if isinstance(value, float) else cell(value)
