"""The mean driving scores of a job or study as a table: what its files and pages show."""

from dataclasses import dataclass

from arena.exports.cells import csv_text
from arena.exports.formats import Format, formats, round_value
from arena.jobs.exports.displacement import SIMULATED_NOTE
from arena.jobs.exports.tables import json_bytes, read_value
from arena.rating.lines import escape
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

SOURCE = "reported in the paper"
SCORE_LABELS = {"nuplan": "nuPlan", "interplan": "interPlan"}
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
        scores, how = self.scores, self.scores.options
        traffic = "reactive" if how.is_reactive else "replayed"
        notes = [
            f"Mean of {SCORE_LABELS[scores.score]}'s score over 15 s drives of the planner "
            f"{how.planner} (offsets: {how.offsets}; recorded traffic {traffic}); contestants by "
            "how much they lower it.",
            *DIFFERENCES,
            *(f"Drives that failed: {number} ({reason})." for reason, number in scores.failures),
        ]
        if scores.outlasting:
            notes.append(
                f"The recording ends before the drive in {scores.outlasting} of {scores.total} "
                "drives: there, who stands stays, who moves goes on along its lane or straight, "
                "and the expert holds the pace of its last second."
            )
        if any(line.close for line in self.lines):
            notes.append(
                f"Drives that pass somebody at less than {CLOSE_M:g} m are counted beside the "
                "score, which takes nothing off for them."
            )
        if scores.under_way:
            notes.append(f"Not complete: {scores.under_way} drives wait or run.")
        return (*notes, *([SIMULATED_NOTE] if self.simulated else []))


MEASURED = "own simulator"
WHO = {"slug": "slug", "model": "model", "variant": "variant", "simulated": "is_simulated"}
COUNTS = {
    "drives": "drives",
    "failed": "failed",
    "least_clearance_m": "least_clearance_m",
    "closer_than_0_3_m": "close",
    "collided": "collided",
    "emergency_braked": "braked",
}
MEANS = {"score_percent": "mean", "before_percent": "before", "lowered_percent": "lowered"}


def driving_table(
    job: GenerationJob, *, options: Options | None = None, score: str, with_paper: bool = False
) -> DrivingTable:
    """Return the table of a job's drives.

    Args:
        job: Whose results were driven.
        options: How they were driven; None for the way in which they were driven last.
        score: One of `SCORES`.
        with_paper: Whether the paper's rows are added.
    """
    if options is None:
        options = next(iter(options_driven(job)), Options())
    scores = scores_of_job(job, options=options, score=score)
    return DrivingTable(title=job.name, scores=scores, with_paper=with_paper)


def csv_bytes(table: DrivingTable) -> bytes:
    """Return one line a contestant, then the paper's if asked for; what is unknown is empty."""
    driven = (kind for line in table.lines for kind in line.by_type)
    kinds = list(in_type_order([*ScenarioType, *driven]))
    types = [f"{kind}_percent" for kind in kinds]
    head = ("scenarios", *WHO, *MEANS, *COUNTS, *types, "source")
    rows = [
        (
            shown_name(line.name, line.is_simulated),
            *(getattr(line, name) for name in WHO.values()),
            *(_percent(getattr(line, name)) for name in MEANS.values()),
            *(getattr(line, name) for name in COUNTS.values()),
            *(_percent(line.by_type[kind]) for kind in kinds),
            MEASURED,
        )
        for line in table.lines
    ]
    for name, score in table.reported:
        known: dict[str, object] = {"scenarios": name, "simulated": "no", "source": SOURCE}
        known["score_percent"] = _percent(score)
        rows.append(tuple(known.get(column, "") for column in head))
    return csv_text(head, rows).encode()


def driving_json(table: DrivingTable) -> bytes:
    """Return everything, shares from 0 to 1."""
    how = table.scores.options
    return json_bytes(
        {
            "format": "scenario-arena/driving",
            "version": 1,
            "title": table.title,
            "score": table.scores.score,
            "planner": how.planner,
            "offsets": how.offsets,
            "reactive": how.is_reactive,
            "simulated": table.simulated,
            "notes": list(table.notes),
            "lines": [
                {"scenarios": line.name, "subject": line.subject}
                | {name: read_value(line, path) for name, path in (WHO | COUNTS).items()}
                | {name: round_value(getattr(line, name)) for name in MEANS.values()}
                | {"by_type": {kind: round_value(mean) for kind, mean in line.by_type.items()}}
                for line in table.lines
            ],
            "reported": [
                {"scenarios": name, "mean": score, "source": SOURCE}
                for name, score in table.reported
            ],
        }
    )


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
    csv=csv_bytes, json=driving_json, latex=latex_bytes
)


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value


def _printed(value: float | None) -> str:
    return "--" if value is None else f"{100.0 * value:.1f}"
