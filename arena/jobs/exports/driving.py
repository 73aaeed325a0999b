"""The mean driving scores of a job or study as a table: what its files and pages show."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from arena.exports.formats import Format, formats, round_value
from arena.exports.tables import shown_name
from arena.rating.printed import escape
from arena.services.cells import csv_text
from augment.services.judging.driving_scores import CLOSE_M, DrivingLine, DrivingScores
from augment.services.scenarios.scenes import ScenarioType, in_type_order, type_choices

SOURCE = "reported in the paper"
REPORTED = (
    ("Val14", 0.908),
    ("interPlan", 0.519),
    ("GPT-4o OTM", 0.496),
    ("Gemini-1.5-Flash OTM", 0.535),
    ("Llama3.1-70B OTM", 0.540),
)
"""The paper's table "Mean driving score of PDM-Closed"; nothing of it was measured here."""
DIFFERENCES = (
    (
        "Measured in this project's own simulator, by nuPlan's rules as far as a scene knows "
        "what they need: compare contestants and the effect of a change, not absolute numbers "
        "with the paper's."
    ),
    (
        "Where nobody recorded the ego, progress is measured by an IDM drive at the speed limit "
        "without the change; where the map ends before 15 s, the drive ends there."
    ),
    (
        "Traffic that was not recorded drives its lanes by the IDM; what stands stays; lights "
        "keep the colour that they have at the start."
    ),
)
"""What differs from nuPlan; docs/simulation.md says it at length."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingTable:
    """The lines and all that must be said with them.

    Attributes:
        with_paper: Whether the paper's rows were asked for, which nobody measured here.
    """

    title: str
    scores: DrivingScores
    with_paper: bool = False

    @property
    def reported(self) -> tuple[tuple[str, float], ...]:
        """The paper's rows, where they were asked for."""
        return REPORTED if self.with_paper else ()

    @property
    def lines(self) -> tuple[DrivingLine, ...]:
        """In the order in which they are shown."""
        return self.scores.lines

    @property
    def simulated(self) -> bool:
        """Whether a contestant in it is simulated."""
        return any(line.is_simulated for line in self.lines)

    @property
    def types(self) -> tuple[tuple[str, str], ...]:
        """Value and label of the scenario types that were driven."""
        driven = {
            kind for line in self.lines for kind, mean in line.by_type.items() if mean is not None
        }
        return tuple((name, label) for name, label in type_choices() if name in driven)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that belong beneath every form of it."""
        said = [self._what, *DIFFERENCES]
        for reason, number in self.scores.failures:
            said.append(f"Drives that failed: {number} ({reason}).")
        if self.scores.outlasting:
            said.append(
                f"The recording ends before the drive in {self.scores.outlasting} of "
                f"{self.scores.total} drives: there, who stands stays, who moves goes on along "
                "its lane or straight, and the expert holds the pace of its last second."
            )
        if any(line.close for line in self.lines):
            said.append(
                f"Drives that pass somebody at less than {CLOSE_M:g} m are counted beside the "
                "score, which takes nothing off for them."
            )
        if self.scores.under_way:
            said.append(f"Not complete: {self.scores.under_way} drives wait or run.")
        if self.simulated:
            said.append("Simulated contestants are marked; they say nothing about a real one.")
        return tuple(said)

    @property
    def _what(self) -> str:
        how = self.scores.options
        score = "nuPlan" if self.scores.score == "nuplan" else "interPlan"
        traffic = "reactive" if how.is_reactive else "replayed"
        return (
            f"Mean of {score}'s score over 15 s drives of the planner {how.planner} (offsets: "
            f"{how.offsets}; recorded traffic {traffic}); contestants by how much they lower it."
        )


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
