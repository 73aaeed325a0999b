"""The mean driving scores of a job or study as a table: what its files and pages show."""

from functools import partial
from typing import Any

from arena.exports.cells import show_name
from arena.exports.formats import Columns, Dtype, Sheet, formats, make_sheet, table_formats
from arena.exports.latex import ValueColumns, escape, latex_values
from arena.jobs.exports.displacement import SIMULATED_NOTE
from augment.services.driving import CLOSE_M, DrivingLine, DrivingScores, PlannerLine, PlannerTable
from augment.services.scenarios import ScenarioType, in_type_order, type_choices

SCORE_LABELS = {"nuplan": "nuPlan", "interplan": "interPlan"}
DIFFERENCE = (
    "Measured in this project's own simulator, by nuPlan's rules as far as a scene knows what "
    "they need: compare contestants and the effect of a change, not absolute numbers with the "
    "paper's."
)
"""What differs from nuPlan; docs/simulation.md says it at length."""


def driving_notes(table: DrivingScores) -> list[str]:
    """Return the sentences that belong beneath every form of the table."""
    how = table.options
    traffic = "reactive" if how.is_reactive else "replayed"
    notes = {
        f"Mean of {SCORE_LABELS[table.score]}'s score over {table.longest_s} s drives of "
        f"version {how.version} by the planner {how.planner} (offsets: {how.offsets}; recorded "
        f"traffic {traffic}); contestants by how much they lower it.": True,
        DIFFERENCE: True,
        f"Recordings that end before the drive: {table.outlasting} of {table.total}; from "
        "there on who stands stays, and who moves goes on.": table.outlasting,
        f"Passing somebody at less than {CLOSE_M:g} m takes nothing off the score.": any(
            line.close for line in table.lines
        ),
        f"Not complete: {table.under_way} drives wait or run.": table.under_way,
        "Driven in nuPlan: by its own simulation elsewhere, read back; never compared with a "
        "scene before its change.": any(line.driven_by for line in table.lines),
        SIMULATED_NOTE: any(line.is_simulated for line in table.lines),
    }
    failed = (f"Drives that failed: {number} ({reason})." for reason, number in table.failures)
    return [*(note for note, holds in notes.items() if holds), *failed]


def driving_context(table: DrivingScores) -> dict[str, Any]:
    """Return the table of drives as pages show it."""
    labels = dict(type_choices())
    return {
        "table": table,
        "types": [labels.get(kind, kind) for kind in table.types],
        "lines": [(line, [line.by_type[kind] for kind in table.types]) for line in table.lines],
        "notes": driving_notes(table),
        "labels": SCORE_LABELS,
        "score": table.score,
    }


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _to_percent(kind: str, line: DrivingLine) -> float | None:
    return _percent(line.by_type[kind])


def _to_estimate(name: str, line: PlannerLine) -> float | None:
    return _percent(getattr(line.estimate, name))


COLUMNS: Columns = {
    "scenarios": (show_name, Dtype.TEXT),
    **Dtype.TEXT.columns("slug", "model", "variant", of="contestant"),
    "simulated": ("is_simulated", Dtype.YES_NO),
    "score_percent": (lambda line: _percent(line.mean), Dtype.NUMBER),
    "before_percent": (lambda line: _percent(line.before), Dtype.NUMBER),
    "lowered_percent": (lambda line: _percent(line.lowered), Dtype.NUMBER),
    **Dtype.WHOLE.columns("drives", "failed"),
    **Dtype.NUMBER.columns("least_clearance_m"),
    "closer_than_0_3_m": ("close", Dtype.WHOLE),
    **Dtype.WHOLE.columns("collided"),
    "emergency_braked": ("braked", Dtype.WHOLE),
    "driven_in_nuplan_by": ("driven_by", Dtype.TEXT),
}


def driving_sheet(table: DrivingScores) -> Sheet:
    """Return one row a contestant, then a column for each scenario type."""
    driven = (kind for line in table.lines for kind in line.by_type)
    kinds = in_type_order([*ScenarioType, *driven])
    types: Columns = {
        f"{kind}_percent": (partial(_to_percent, kind), Dtype.NUMBER) for kind in kinds
    }
    facts = {
        "title": table.title,
        "score": table.score,
        "planner": table.options.planner,
        "offsets": table.options.offsets,
        "reactive": table.options.is_reactive,
        "version": table.options.version,
        "notes": driving_notes(table),
    }
    columns: Columns = {**COLUMNS, **types}
    return make_sheet(table.lines, columns, name="driving", key="lines", number=".2f", facts=facts)


def driving_latex(table: DrivingScores) -> bytes:
    """Return the paper's table with a second column for the scenes before the change."""
    columns: ValueColumns = {
        "Scenarios": show_name,
        "Mean Driving Score [%]": lambda line: _percent(line.mean),
        "n": lambda line: line.drives,
        "Before [%]": lambda line: _percent(line.before),
        "Clearance below 0.3 m": lambda line: line.close,
    }
    planner = escape(table.options.planner)
    but = ", unless a row says otherwise" * any(line.driven_by for line in table.lines)
    caption = f"Mean driving score of {planner} in Scenario Arena's own simulator{but}; n: drives."
    return latex_values(
        table.lines,
        columns,
        number=".1f",
        comments=driving_notes(table),
        caption=caption,
        label="tab:driving_score",
    )


FORMATS = table_formats(driving_sheet) | formats(latex=driving_latex)


# --- Planners beside each other ----------------------------------------------------------------

FEW_SCENES = 12
"""With fewer, intervals of high means hold less often than they say (docs/simulation.md)."""


def planner_notes(table: PlannerTable) -> list[str]:
    """Return the sentences that belong beneath every form of the table of planners."""
    estimates = [[line.estimate for line in lines] for lines in table.groups]
    fewest = min((one.scenes for group in estimates for one in group), default=0)
    notes = {
        f"Mean of {SCORE_LABELS[table.score]}'s score, drives of version {table.version}; 95 % "
        "intervals clustered by scene. Planners with a common letter can't be told apart at 5 % "
        "for all differences of the table (paired t tests on the same drives, Holm).": True,
        "Not all planners finished the same drives: a mean is of a planner's own, differences and "
        "letters are of those that both finished.": any(
            len({one.drives for one in group}) > 1 for group in estimates
        ),
        f"The fewest scenes behind a line: {fewest}.": fewest < FEW_SCENES,
        DIFFERENCE: True,
    }
    return [note for note, holds in notes.items() if holds]


def planner_context(table: PlannerTable) -> dict[str, Any]:
    """Return the table of planners as pages show it: a row a contestant, a column a planner."""
    rows = []
    for lines in table.groups:
        means = {line.planner: line for line in lines if not line.against}
        drives = sorted({line.estimate.drives for line in means.values()})
        number = " to ".join(dict.fromkeys((str(drives[0]), str(drives[-1]))))
        rows.append((lines[0], number, [means.get(name) for name in table.planners]))
    pairs = [line for lines in table.groups for line in lines if line.against]
    return {"table": table, "rows": rows, "pairs": pairs, "notes": planner_notes(table)}


PLANNER_COLUMNS: Columns = {
    "scenarios": (show_name, Dtype.TEXT),
    "slug": ("contestant.slug", Dtype.TEXT),
    "simulated": ("is_simulated", Dtype.YES_NO),
    **Dtype.TEXT.columns("planner", "against"),
    **{
        f"{name}_percent": (partial(_to_estimate, name), Dtype.NUMBER)
        for name in ("mean", "low", "high")
    },
    "p": ("estimate.p", Dtype.NUMBER),
    **Dtype.NUMBER.columns("p_holm"),
    **Dtype.TEXT.columns("sets"),
    **Dtype.WHOLE.columns("drives", "scenes", of="estimate"),
}
"""A row with `against` is a difference of two planners on the same drives."""


def planner_sheet(table: PlannerTable) -> Sheet:
    """Return a row a planner, then a row a pair of them, for each contestant."""
    lines = [line for group in table.groups for line in group]
    facts = {"title": table.title, "score": table.score, "version": table.version}
    facts |= {"planners": table.planners, "notes": planner_notes(table)}
    columns = PLANNER_COLUMNS
    return make_sheet(
        lines, columns, digits=6, name="planners", key="lines", number=".4g", facts=facts
    )


def planner_latex(table: PlannerTable) -> bytes:
    """Return a row a contestant and a column a planner: mean, interval, letters."""

    def show(place: int, row: tuple[PlannerLine, str, list[PlannerLine | None]]) -> str | None:
        line = row[2][place]
        return None if line is None else estimate_text(line)

    columns: ValueColumns = {
        "Scenarios": lambda row: show_name(row[0]),
        "n": lambda row: row[1],
        **{name: partial(show, place) for place, name in enumerate(table.planners)},
    }
    return latex_values(
        planner_context(table)["rows"],
        columns,
        comments=planner_notes(table),
        caption=r"Mean driving score [\%] with 95\% intervals clustered by scene; planners with a "
        r"common letter can't be told apart (Holm, 5\%).",
        label="tab:planners",
    )


def estimate_text(line: PlannerLine) -> str:
    """Return mean, interval and letters, in percent."""
    estimate = line.estimate
    text = f"{100.0 * estimate.mean:.1f}"
    if estimate.low is not None and estimate.high is not None:
        text += f" [{100.0 * estimate.low:.1f}, {100.0 * estimate.high:.1f}]"
    return f"{text} {line.sets}"


PLANNER_FORMATS = table_formats(planner_sheet) | formats(latex=planner_latex)
