"""The mean driving scores of a job or study as a table: what its files and pages show."""

from dataclasses import dataclass
from typing import Any

from arena.exports.formats import (
    NUMBER,
    TEXT,
    WHOLE,
    YES_NO,
    Columns,
    Sheet,
    Value,
    formats,
    read_value,
    sheet_of,
    table_formats,
)
from arena.jobs.exports.displacement import SIMULATED_NOTE
from arena.rating.lines import escape, latex_table
from arena.results.exports.tables import shown_name
from augment.models import GenerationJob
from augment.services.judging.driving_scores import (
    CLOSE_M,
    DrivingLine,
    DrivingScores,
    options_driven,
    scores_of_job,
)
from augment.services.judging.simulations import Options
from augment.services.scenarios.scenes import ScenarioType, in_type_order, type_choices

SCORE_LABELS = {"nuplan": "nuPlan", "interplan": "interPlan"}
DIFFERENCE = (
    "Measured in this project's own simulator, by nuPlan's rules as far as a scene knows what "
    "they need: compare contestants and the effect of a change, not absolute numbers with the "
    "paper's."
)
"""What differs from nuPlan; docs/simulation.md says it at length."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingTable:
    """The lines and all that must be said with them."""

    title: str
    scores: DrivingScores

    @property
    def lines(self) -> tuple[DrivingLine, ...]:
        """In the order in which they are shown."""
        return self.scores.lines

    @property
    def types(self) -> tuple[tuple[str, str], ...]:
        """Value and label of the scenario types that were driven."""
        means = [item for line in self.lines for item in line.by_type.items()]
        driven = {kind for kind, mean in means if mean is not None}
        return tuple((name, label) for name, label in type_choices() if name in driven)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that belong beneath every form of it."""
        scores, how = self.scores, self.scores.options
        traffic = "reactive" if how.is_reactive else "replayed"
        notes = {
            f"Mean of {SCORE_LABELS[scores.score]}'s score over 15 s drives of the planner "
            f"{how.planner} (offsets: {how.offsets}; recorded traffic {traffic}); contestants by "
            "how much they lower it.": True,
            DIFFERENCE: True,
            f"Recordings that end before the drive: {scores.outlasting} of {scores.total}; from "
            "there on who stands stays, and who moves goes on.": scores.outlasting,
            f"Passing somebody at less than {CLOSE_M:g} m takes nothing off the score.": any(
                line.close for line in self.lines
            ),
            f"Not complete: {scores.under_way} drives wait or run.": scores.under_way,
            SIMULATED_NOTE: any(line.is_simulated for line in self.lines),
        }
        failed = (
            f"Drives that failed: {number} ({reason})." for reason, number in scores.failures
        )
        return (*(note for note, holds in notes.items() if holds), *failed)


def driving_table(
    job: GenerationJob, *, options: Options | None = None, score: str
) -> DrivingTable:
    """Return the table of a job's drives.

    Args:
        job: Whose results were driven.
        options: How they were driven; None for the way in which they were driven last.
        score: One of `SCORES`.
    """
    if options is None:
        options = next(iter(options_driven(job)), Options())
    scores = scores_of_job(job, options=options, score=score)
    return DrivingTable(title=job.name, scores=scores)


def shown_driving(table: DrivingTable) -> dict[str, Any]:
    """Return what pages need of the table."""
    lines = [
        {"line": line, "types": [line.by_type[kind] for kind, _ in table.types]}
        for line in table.lines
    ]
    score = table.scores.score
    return {"table": table, "lines": lines, "labels": SCORE_LABELS, "score": score}


def _percent(path: str) -> Value:
    """Return what reads a share as a number in percent."""

    def read(line: DrivingLine) -> float | None:
        share = read_value(line, path, None)
        return 100.0 * share if isinstance(share, float) else None

    return read


def _percent_of_type(kind: str) -> Value:
    def read(line: DrivingLine) -> float | None:
        share = line.by_type[kind]
        return None if share is None else 100.0 * share

    return read


COLUMNS: Columns = {
    "scenarios": (lambda line: shown_name(line.name, line.is_simulated), TEXT),
    **{name: (name, TEXT) for name in ("slug", "model", "variant")},
    "simulated": ("is_simulated", YES_NO),
    "score_percent": (_percent("mean"), NUMBER),
    "before_percent": (_percent("before"), NUMBER),
    "lowered_percent": (_percent("lowered"), NUMBER),
    "drives": ("drives", WHOLE),
    "failed": ("failed", WHOLE),
    "least_clearance_m": ("least_clearance_m", NUMBER),
    "closer_than_0_3_m": ("close", WHOLE),
    "collided": ("collided", WHOLE),
    "emergency_braked": ("braked", WHOLE),
}


def driving_sheet(table: DrivingTable) -> Sheet:
    """Return one row a contestant, then a column for each scenario type."""
    driven = (kind for line in table.lines for kind in line.by_type)
    kinds = in_type_order([*ScenarioType, *driven])
    types: Columns = {f"{kind}_percent": (_percent_of_type(kind), NUMBER) for kind in kinds}
    how = table.scores.options
    facts = {
        "title": table.title,
        "score": table.scores.score,
        "planner": how.planner,
        "offsets": how.offsets,
        "reactive": how.is_reactive,
        "notes": table.notes,
    }
    columns: Columns = {**COLUMNS, **types}
    return sheet_of(table.lines, columns, name="driving", key="lines", number=".2f", facts=facts)


def driving_latex(table: DrivingTable) -> bytes:
    """Return the paper's table with a second column for the scenes before the change."""
    heads = ("Scenarios", "Mean Driving Score [%]", "n", "Before [%]", "Clearance below 0.3 m")
    rows = (
        (
            escape(shown_name(line.name, line.is_simulated)),
            *(_printed(line.mean), str(line.drives), _printed(line.before), str(line.close)),
        )
        for line in table.lines
    )
    planner = escape(table.scores.options.planner)
    caption = f"Mean driving score of {planner} in Scenario Arena's own simulator; n: drives."
    text = latex_table(
        rows, heads=heads, comments=table.notes, caption=caption, label="tab:driving_score"
    )
    return text.encode()


FORMATS = table_formats(driving_sheet) | formats(latex=driving_latex)


def _printed(share: float | None) -> str:
    return "--" if share is None else f"{100.0 * share:.1f}"
