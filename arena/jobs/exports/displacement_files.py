"""Displacement errors as files. The same job always gives the same bytes."""

from typing import Any

from arena.exports.cells import csv_text
from arena.exports.formats import Format, drawings, formats, round_value
from arena.jobs.exports.displacement import SOURCE, DisplacementTable
from arena.jobs.exports.tables import Value, json_bytes, read_value
from arena.results.exports.box_plot import box_plot
from arena.results.exports.tables import shown_name
from augment.services.judging.displacement import Displacement, Group

GROUP: dict[str, Value] = {
    "group": "heading",
    "contestant": lambda group: shown_name(group.contestant, group.is_simulated),
    **{name: name for name in ("slug", "model", "variant")},
    "simulated": "is_simulated",
    **{name: f"summary.{name}" for name in ("augmentations", "n", "missing", "surplus")},
}
BOX = ("median_m", "q1_m", "q3_m", "mean_m", "low_m", "high_m")
COLUMNS = (*GROUP, *BOX, "outliers_m", "source", "types")


def csv_bytes(table: DisplacementTable) -> bytes:
    """Return one line a group, then one a published box; what is unknown is empty."""
    types = " ".join(table.types)
    rows = []
    for group in table.groups:
        box = group.summary.box
        sizes = [None] * len(BOX) if box is None else [getattr(box, name) for name in BOX]
        outliers = "" if box is None else " ".join(f"{one:.3f}" for one in box.outliers_m)
        known = [read_value(group, value) for value in GROUP.values()]
        rows.append([*known, *sizes, outliers, "measured", types])
    for published in table.published:
        named = {
            "group": published.variant,
            "contestant": f"{published.model} {published.variant} (paper)",
            "model": published.model,
            "variant": published.variant,
            "simulated": "no",
            **{name: str(getattr(published, name, "")) for name in BOX},
            "source": SOURCE,
            "types": types,
        }
        rows.append([named.get(name, "") for name in COLUMNS])
    return csv_text(COLUMNS, rows, number=".3f").encode()


def displacement_json(table: DisplacementTable) -> bytes:
    """Return groups, published boxes, and every augmentation with its own distances."""
    return json_bytes(
        {
            "format": "scenario-arena/displacement",
            "version": 1,
            "job": table.job,
            "by": table.by.value,
            "types": list(table.types),
            "simulated": table.simulated,
            "notes": list(table.notes),
            "not_measured": table.left_out,
            "groups": [_group(group) for group in table.groups],
            "published": [{"source": SOURCE} | box._asdict() for box in table.published],
            "augmentations": [
                {
                    "scenario": one.row.scenario.slug,
                    "type": one.row.scenario.type,
                    "contestant": one.row.contestant.slug,
                    "sample": one.row.sample,
                    "state": one.row.state,
                    **_objects(one.displacement),
                }
                for one in table.measured
                if one.displacement is not None
            ],
        }
    )


FORMATS: dict[str, Format[DisplacementTable]] = formats(
    csv=csv_bytes, json=displacement_json, **drawings(box_plot)
)


def _group(group: Group) -> dict[str, Any]:
    known = {name: read_value(group, value) for name, value in GROUP.items()}
    box: dict[str, Any] | None = None
    if group.summary.box is not None:
        box = {name: round_value(getattr(group.summary.box, name)) for name in BOX}
        box["outliers_m"] = [round_value(one) for one in group.summary.box.outliers_m]
    return known | {"contestant": group.contestant, "box": box}


def _objects(displacement: Displacement) -> dict[str, Any]:
    return {
        "missing": list(displacement.missing),
        "surplus": list(displacement.surplus),
        "matches": [
            {
                "reference": match.reference,
                "generated": match.generated,
                "class": match.object_class.value,
                "distance_m": round_value(match.distance_m),
            }
            for match in displacement.matches
        ],
    }
