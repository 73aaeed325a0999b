"""Displacement errors as files. The same job always gives the same bytes."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Collection, Sequence
from typing import Any

from arena.exports.charts.displacement import box_plot
from arena.exports.formats import Format, drawings, formats, round_value
from arena.exports.parquet import NUMBER, TEXT, WHOLE, YES_NO, parquet_bytes
from arena.exports.tables import shown_name
from arena.jobs.exports.displacement import SOURCE, DisplacementTable, PublishedBox
from arena.services.cells import cell, csv_text
from augment.models import GenerationJob
from augment.services.judging.displacement import (
    BoxSummary,
    DisplacedObject,
    Group,
    Measured,
    ObjectPosition,
    objects_of,
)

COLUMNS = (
    "group", "contestant", "slug", "model", "variant", "simulated", "augmentations", "n",
    "missing", "surplus", "median_m", "q1_m", "q3_m", "mean_m", "low_m", "high_m", "outliers_m",
    "source", "types",
)  # fmt: skip
MEASURED = "measured"


def csv_bytes(table: DisplacementTable) -> bytes:
    """One line a group, then one a published box; what is unknown is empty."""
    types = " ".join(table.types)
    rows: list[Sequence[object]] = []
    for group in table.groups:
        found = group.summary
        counts = (found.augmentations, found.n, found.missing, found.surplus)
        rows.append((*_who(group), *counts, *_numbers(found.box), MEASURED, types))
    for box in table.published:
        numbers = [f"{one:.1f}" for one in (box.median_m, box.q1_m, box.q3_m)]
        named = [box.variant, f"{box.model} {box.variant} (paper)", "", box.model, box.variant]
        unknown = ["no", "", "", "", ""]
        rows.append([*named, *unknown, *numbers, "", "", f"{box.high_m:.1f}", "", SOURCE, types])
    return csv_text(COLUMNS, rows).encode()


def json_bytes(table: DisplacementTable) -> bytes:
    """Groups, published boxes, and every augmentation with its own distances."""
    document: dict[str, Any] = {
        "format": "scenario-arena/displacement",
        "version": 1,
        "job": table.job,
        "by": table.by.value,
        "types": list(table.types),
        "simulated": table.simulated,
        "notes": list(table.notes),
        "not_measured": table.left_out,
        "groups": [_group(group) for group in table.groups],
        "published": [_published(box) for box in table.published],
        "augmentations": [_single(one) for one in table.measured if one.displacement is not None],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


FORMATS: dict[str, Format[DisplacementTable]] = formats(
    csv=csv_bytes, json=json_bytes, **drawings(box_plot)
)


# Private


def _who(group: Group) -> tuple[object, ...]:
    return (
        group.heading, shown_name(group.contestant, group.is_simulated), group.slug,
        group.model, group.variant, group.is_simulated,
    )  # fmt: skip


def _numbers(box: BoxSummary | None) -> list[str]:
    """Median, quartiles, mean, whiskers and outliers, to the millimetre."""
    if box is None:
        return [""] * 7
    numbers = (box.median_m, box.q1_m, box.q3_m, box.mean_m, box.low_m, box.high_m)
    outliers = " ".join(f"{one:.3f}" for one in box.outliers_m)
    return [*(f"{one:.3f}" for one in numbers), outliers]


def _group(group: Group) -> dict[str, Any]:
    found = group.summary
    return {
        "group": group.heading,
        "contestant": group.contestant,
        "slug": group.slug,
        "model": group.model,
        "variant": group.variant,
        "simulated": group.is_simulated,
        "augmentations": found.augmentations,
        "n": found.n,
        "missing": found.missing,
        "surplus": found.surplus,
        "box": None if found.box is None else _box(found.box),
    }


def _box(box: BoxSummary) -> dict[str, Any]:
    return {
        "median_m": round_value(box.median_m),
        "q1_m": round_value(box.q1_m),
        "q3_m": round_value(box.q3_m),
        "mean_m": round_value(box.mean_m),
        "low_m": round_value(box.low_m),
        "high_m": round_value(box.high_m),
        "outliers_m": [round_value(one) for one in box.outliers_m],
    }


def _published(box: PublishedBox) -> dict[str, Any]:
    return {
        "source": SOURCE,
        "model": box.model,
        "variant": box.variant,
        "median_m": box.median_m,
        "q1_m": box.q1_m,
        "q3_m": box.q3_m,
        "high_m": box.high_m,
    }


def _single(one: Measured) -> dict[str, Any]:
    assert one.displacement is not None
    return {
        "scenario": one.row.scenario.slug,
        "type": one.row.scenario.type,
        "contestant": one.row.contestant.slug,
        "sample": one.row.sample,
        "state": one.row.state,
        "missing": list(one.displacement.missing),
        "surplus": list(one.displacement.surplus),
        "matches": [
            {
                "reference": match.reference,
                "generated": match.generated,
                "class": match.object_class.value,
                "distance_m": round_value(match.distance_m),
            }
            for match in one.displacement.matches
        ],
    }


BY_OBJECT = "object"
"""How it is asked for, beside the groupings."""

OBJECT_COLUMNS = {
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


def object_csv(rows: Rows) -> bytes:
    """One line an object; a text is no formula, and a number may be negative."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(OBJECT_COLUMNS)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return sheet.getvalue().encode()


def object_json(rows: Rows) -> bytes:
    """A list of objects with the same names."""
    document = {
        "format": "scenario-arena/displacement-objects",
        "version": 1,
        "objects": [dict(zip(OBJECT_COLUMNS, row, strict=True)) for row in rows],
    }
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


def parquet_of(rows: Rows) -> bytes:
    """The same columns, typed."""
    return parquet_bytes(OBJECT_COLUMNS, rows)


OBJECT_FORMATS: dict[str, Format[Rows]] = formats(
    csv=object_csv, json=object_json, parquet=parquet_of
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
