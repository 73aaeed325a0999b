"""Mean driving scores as a file. The same drives always give the same bytes."""

from __future__ import annotations

import json
from typing import Any

from arena.exports.formats import Format, formats, round_value
from arena.exports.tables import shown_name
from arena.jobs.exports.driving import SOURCE, DrivingTable
from arena.rating.printed import escape
from arena.services.cells import csv_text
from augment.services.judging.driving_scores import DrivingLine
from augment.services.scenarios.scenes import ScenarioType, in_type_order

MEASURED = "own simulator"
_BEFORE = (
    "scenarios", "slug", "model", "variant", "simulated", "score_percent", "before_percent",
    "lowered_percent", "drives", "failed", "least_clearance_m", "closer_than_0_3_m", "collided",
    "emergency_braked",
)  # fmt: skip


def csv_bytes(table: DrivingTable) -> bytes:
    """One line a contestant, then the paper's if asked for; what is unknown is empty."""
    rows: list[list[object]] = []
    kinds = _kinds(table)
    for line in table.lines:
        who = [
            shown_name(line.name, line.is_simulated),
            line.slug,
            line.model,
            line.variant,
            line.is_simulated,
        ]
        means = [_percent(value) for value in (line.mean, line.before, line.lowered)]
        clearance = "" if line.least_clearance_m is None else f"{line.least_clearance_m:.2f}"
        counts = [line.drives, line.failed, clearance, line.close, line.collided, line.braked]
        types = [_percent(line.by_type[kind]) for kind in kinds]
        rows.append([*who, *means, *counts, *types, MEASURED])
    blank = [""] * len(kinds)
    for name, score in table.reported:
        rows.append([name, "", "", "", "no", _percent(score), *[""] * 8, *blank, SOURCE])
    head = (*_BEFORE, *(f"{kind}_percent" for kind in kinds), "source")
    return csv_text(head, rows).encode()


def _kinds(table: DrivingTable) -> tuple[str, ...]:
    """A column each: the five types, and one's own that were driven."""
    driven = (kind for line in table.lines for kind in line.by_type)
    return tuple(in_type_order([*ScenarioType, *driven]))


def json_bytes(table: DrivingTable) -> bytes:
    """Everything, shares from 0 to 1."""
    how = table.scores.options
    document: dict[str, Any] = {
        "format": "scenario-arena/driving",
        "version": 1,
        "title": table.title,
        "score": table.scores.score,
        "planner": how.planner,
        "offsets": how.offsets,
        "reactive": how.is_reactive,
        "simulated": table.simulated,
        "notes": list(table.notes),
        "lines": [_line(line) for line in table.lines],
        "reported": [
            {"scenarios": name, "mean": score, "source": SOURCE} for name, score in table.reported
        ],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


def latex_bytes(table: DrivingTable) -> bytes:
    """The paper's table with a second column for the scenes before the change; booktabs."""
    lines = [
        r"% \usepackage{booktabs}",
        *(f"% {note}" for note in table.notes),
        r"\begin{table}",
        r"    \centering",
        r"    \begin{tabular}{lrrrr}",
        r"    \toprule",
        r"    \textbf{Scenarios} & \textbf{n} & \textbf{Mean Driving Score} [\%]"
        r" & \textbf{Before} [\%] & \textbf{Clearance below 0.3 m} \\",
        r"    \midrule",
        *(
            rf"    {escape(name)} & {line.drives} & {_printed(line.mean)}"
            rf" & {_printed(line.before)} & {line.close} \\"
            for line in table.lines
            for name in [shown_name(line.name, line.is_simulated)]
        ),
        *([r"    \midrule"] if table.reported else []),
        *(
            rf"    {escape(name)} ({escape(SOURCE)}) & -- & {_printed(score)} & -- & -- \\"
            for name, score in table.reported
        ),
        r"    \bottomrule",
        r"    \end{tabular}",
        rf"    \caption{{Mean driving score of {escape(table.scores.options.planner)} in Scenario"
        r" Arena's own simulator; n: drives.}",
        r"    \label{tab:driving_score}",
        r"\end{table}",
    ]
    return ("\n".join(lines) + "\n").encode()


FORMATS: dict[str, Format[DrivingTable]] = formats(
    csv=csv_bytes, json=json_bytes, latex=latex_bytes
)


# Private


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.2f}"


def _printed(value: float | None) -> str:
    return "--" if value is None else f"{100.0 * value:.1f}"


def _line(line: DrivingLine) -> dict[str, Any]:
    return {
        "scenarios": line.name,
        "subject": line.subject,
        "slug": line.slug,
        "model": line.model,
        "variant": line.variant,
        "simulated": line.is_simulated,
        "mean": round_value(line.mean),
        "before": round_value(line.before),
        "lowered": round_value(line.lowered),
        "drives": line.drives,
        "failed": line.failed,
        "least_clearance_m": round_value(line.least_clearance_m),
        "closer_than_0_3_m": line.close,
        "collided": line.collided,
        "emergency_braked": line.braked,
        "by_type": {kind: round_value(mean) for kind, mean in line.by_type.items()},
    }
