"""Distances to the wish and displacement of a job: in groups, by object, and as box plots."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from arena.exports import formats
from arena.exports.cells import show_name
from arena.exports.drawing import MARK, chart_style, draw_once, name_lines, write_figure
from augment.models import GenerationJob
from augment.services.judging import PLACED_EXACTLY, list_objects
from augment.services.judging.displacement import (
    HORIZON_S,
    BoxSummary,
    By,
    Group,
    Summary,
    groups,
    of_job,
    summarise,
)
from augment.services.scenarios import ScenarioType, in_type_order, type_choices

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAPERS_CHOICE = (
    "As in the paper, construction zone and accident site are left out: their objects can lie in "
    "many places that all follow the instruction."
)
OVER_TIME_NOTE = (
    f"Where something moves, a distance is the mean over the {HORIZON_S:g} s after t0; beside it "
    "the means at t0 and at the end, and by how many seconds motions begin apart."
)
WISH_NOTE = (
    "Distance to the wish: of each object from where the nearest placement has it that the "
    "instruction allows, 0 for whatever it allows; of scenarios with an intent."
)
KEPT_NOTE = (
    "Kept: of what follow-ups were to leave as in the answer before, how much looks the same, and "
    "how far it was moved."
)
SIMULATED_NOTE = "Simulated contestants are marked; they say nothing about a real one."

MOST_NAMED = 8
"""So many scenario types are named; of more their number is told."""
FAR = 4.0
"""Values this many times beyond the longest whisker make the axis logarithmic."""
LINEAR_UP_TO_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacementTable:
    """A job's groups in order, and all that must be said with them.

    Attributes:
        types: The scenario types that count, by their names.
        left_out: Augmentations without a displacement, by reason.
    """

    job: str
    by: By
    types: tuple[str, ...]
    groups: tuple[Group, ...]
    left_out: dict[str, int]

    @property
    def simulated(self) -> bool:
        """True if one of its contestants is simulated."""
        return any(group.contestant.is_simulated for group in self.groups)

    @property
    def wishes(self) -> bool:
        """True if one of its scenarios has an intent."""
        return any(group.wish for group in self.groups)

    @property
    def moves(self) -> bool:
        """True if an object moves in it."""
        return any(group.summary.over_time for group in self.groups)

    @property
    def has_follow_ups(self) -> bool:
        """True if anything was to be left alone."""
        return any(group.kept for group in self.groups)

    @property
    def columns(self) -> int:
        """Number of columns that a page shows."""
        return 7 + 3 * self.wishes + 3 * self.moves + 2 * self.has_follow_ups

    @property
    def types_text(self) -> str:
        """Scenario types that count, in words."""
        if self.types == tuple(ScenarioType):
            return "All five scenario types"
        if len(self.types) > MOST_NAMED:
            return f"{len(self.types)} scenario types"
        labels = dict(type_choices())
        return f"Scenario types: {', '.join(labels.get(name, name) for name in self.types)}"

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences that belong beneath every form of it, beside the scenario types."""
        return (
            *([WISH_NOTE] if self.wishes else []),
            "Displacement: distances between centres, in metres, of objects matched within their "
            "class so that their sum is smallest; each matched object counts once.",
            "Missing and surplus objects are counted and have no distance; an unreadable or "
            "refused answer misses all.",
            *([OVER_TIME_NOTE] if self.moves else []),
            *([KEPT_NOTE] if self.has_follow_ups else []),
            *([PAPERS_CHOICE] if self.by is By.VARIANT else []),
            *(f"Not measured: {number} ({why})." for why, number in self.left_out.items()),
            *([SIMULATED_NOTE] if self.simulated else []),
        )


def displacement_table(job: GenerationJob, *, by: By) -> DisplacementTable:
    """Return the table of a job, grouped by that and the contestant; one query."""
    measured = of_job(job)
    every = in_type_order([*ScenarioType, *(line.row.scenario.type for line in measured)])
    left_out = Counter(line.why_not.value for line in measured if line.why_not is not None)
    return DisplacementTable(
        job=job.name,
        by=by,
        types=PLACED_EXACTLY if by is By.VARIANT else tuple(every),
        groups=tuple(groups(measured, by=by)),
        left_out=dict(sorted(left_out.items())),
    )


def kept_columns(of: str) -> formats.Columns:
    """Of follow-ups: what was to stay of the answer before, what did, and how far it was moved."""
    counts = formats.Dtype.WHOLE.columns("to_keep", "kept", of=of)
    return {**counts, **formats.Dtype.NUMBER.columns("moved_mean_m", of=of)}


_GROUPED: formats.Columns = {
    "group": ("heading", formats.Dtype.TEXT),
    "contestant": (lambda group: show_name(group.contestant), formats.Dtype.TEXT),
    **formats.Dtype.TEXT.columns("slug", "model", "variant", of="contestant"),
    "simulated": ("contestant.is_simulated", formats.Dtype.YES_NO),
}
GROUPS: formats.Columns = {
    **_GROUPED,
    **formats.Dtype.WHOLE.columns("augmentations", "n", "missing", "surplus", of="summary"),
    **formats.Dtype.NUMBER.columns(
        "median_m", "q1_m", "q3_m", "mean_m", "low_m", "high_m", of="summary.box"
    ),
    **kept_columns("kept"),
    "outliers_m": (
        lambda group: formats.join_numbers(getattr(group.summary.box, "outliers_m", ()), ".3f"),
        formats.Dtype.TEXT,
    ),
}
WISHED: formats.Columns = {
    "wish_median_m": ("wish.box.median_m", formats.Dtype.NUMBER),
    "wish_mean_m": ("wish.box.mean_m", formats.Dtype.NUMBER),
    **{
        f"wish_{name}": (f"wish.{name}", formats.Dtype.WHOLE)
        for name in ("n", "missing", "surplus")
    },
}
"""Of groups, where one of them has an intent."""
OVER_TIME = formats.Dtype.NUMBER.columns("at_t0_m", "final_m", "start_s", of="summary.over_time")
"""Of groups, where one of them has something that moves."""


def group_sheet(table: DisplacementTable) -> formats.Sheet:
    """Return one row a group."""
    types = " ".join(table.types)
    facts = {
        "job": table.job,
        "by": table.by.value,
        "simulated": table.simulated,
        "notes": [f"{table.types_text}.", *table.remarks],
        "not_measured": table.left_out,
    }
    columns: formats.Columns = {
        **_GROUPED,
        **(WISHED if table.wishes else {}),
        **GROUPS,
        "types": (lambda group: types, formats.Dtype.TEXT),
    }
    if table.moves:
        columns = {**columns, **OVER_TIME}
    return formats.make_sheet(
        table.groups, columns, name="displacement", key="groups", number=".3f", facts=facts
    )


# --- One row an object -------------------------------------------------------------------------


WHOSE: formats.Columns = {
    "scenario": ("row.scenario.slug", formats.Dtype.TEXT),
    "type": ("row.scenario.type", formats.Dtype.TEXT),
    "contestant": ("row.contestant.slug", formats.Dtype.TEXT),
    **formats.Dtype.TEXT.columns("name", "model", "variant", of="row.contestant"),
    "simulated": ("row.contestant.is_simulated", formats.Dtype.YES_NO),
}
OBJECTS: formats.Columns = {
    **WHOSE,
    "augmentation": ("row.code", formats.Dtype.TEXT),
    "state": ("row.state", formats.Dtype.TEXT),
    **formats.Dtype.TEXT.columns("object", "class"),
    "reference": ("reference.id", formats.Dtype.TEXT),
    "reference_x_m": ("reference.x_m", formats.Dtype.NUMBER),
    "reference_y_m": ("reference.y_m", formats.Dtype.NUMBER),
    "generated": ("generated.id", formats.Dtype.TEXT),
    "x_m": ("generated.x_m", formats.Dtype.NUMBER),
    "y_m": ("generated.y_m", formats.Dtype.NUMBER),
    **formats.Dtype.NUMBER.columns("distance_m", of="match"),
    "sample": ("row.sample", formats.Dtype.WHOLE),
}
"""`object` is matched, missing or surplus; places are in the ego frame."""
MATCHES_OVER_TIME = formats.Dtype.NUMBER.columns("average_m", "final_m", "start_s", of="match")
"""Of objects, where one moves."""


def object_sheet(job: GenerationJob) -> formats.Sheet:
    """Return the displacement of a job with one row an object."""
    name, objects = "displacement-objects", list(list_objects(job))
    moves = any(entry["match"] and entry["match"].average_m is not None for entry in objects)
    columns = {**OBJECTS, **MATCHES_OVER_TIME} if moves else OBJECTS
    if any(thing["wish_m"] is not None for thing in objects):
        columns = {**WHOSE, "wish_distance_m": ("wish_m", formats.Dtype.NUMBER), **columns}
    return formats.make_sheet(objects, columns, name=name, key="objects", number=".4f")


# --- Box plots ---------------------------------------------------------------------------------


def box_plot(table: DisplacementTable, *, file_format: str) -> bytes:
    """Draw a box a group: quartiles, median, Tukey's whiskers, outliers, mean as a diamond.

    The distances to the wish stand above, where there is an intent.
    """
    from matplotlib.figure import Figure

    panels = {"Displacement error (m)": [group.summary for group in table.groups]}
    if table.wishes:
        wishes = [group.wish or summarise([]) for group in table.groups]
        panels = {"Distance to the wish (m)": wishes, **panels}
    height = 0.8 + len(panels) * (0.6 + 0.3 * len(table.groups))
    with chart_style():
        figure = Figure(figsize=(7.2, height), layout="constrained")
        rows = figure.subplots(len(panels), squeeze=False)[:, 0]
        for axes, (words, summaries) in zip(rows, panels.items(), strict=True):
            _draw_boxes(axes, table, summaries)
            if table.wishes:
                axes.set_title(words, fontsize=8, loc="left")
        marks = ", with simulated contestants" if table.simulated else ""
        legend = "Boxes: quartiles around the median; whiskers: up to 1.5 boxes; diamonds: means"
        heading = "Metres" if table.wishes else "Displacement error (m)"
        figure.supxlabel(f"{heading}{marks}\n{table.types_text}\n{legend}", fontsize=8)
        return write_figure(figure, file_format)


def _draw_boxes(axes: Axes, table: DisplacementTable, summaries: Sequence[Summary]) -> None:
    boxes = {place: _stats(summary.box) for place, summary in enumerate(summaries) if summary.box}
    axes.bxp(
        list(boxes.values()),
        positions=list(boxes),
        widths=0.56,
        orientation="horizontal",
        manage_ticks=False,
        patch_artist=True,
        showmeans=True,
        boxprops={"facecolor": f"{MARK}33", "edgecolor": MARK},
        medianprops={"color": MARK, "linewidth": 2.2},
        meanprops={"marker": "D", "markersize": 3.5, "markerfacecolor": "white"},
        flierprops={"marker": "o", "markersize": 3.2, "markeredgecolor": MARK},
    )
    names = [
        _name(table, group, summary)
        for group, summary in zip(table.groups, summaries, strict=True)
    ]
    name_lines(axes, names, [group.contestant.is_simulated for group in table.groups])
    # Logarithmic beyond 1 m where outliers would squeeze all boxes.
    longest = max([LINEAR_UP_TO_M, *(box["whishi"] for box in boxes.values())])
    if any(outlier > FAR * longest for box in boxes.values() for outlier in box["fliers"]):
        axes.set_xscale("symlog", linthresh=LINEAR_UP_TO_M, subs=[2.0, 5.0])
        axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlim(left=0.0)


def _stats(box: BoxSummary) -> dict[str, Any]:
    """Return a box as matplotlib takes it."""
    return {
        "med": box.median_m,
        "q1": box.q1_m,
        "q3": box.q3_m,
        "whislo": box.low_m,
        "whishi": box.high_m,
        "mean": box.mean_m,
        "fliers": list(box.outliers_m),
    }


def _name(table: DisplacementTable, group: Group, summary: Summary) -> str:
    """Return the label of a box: its group, and its number of objects."""
    name = show_name(group.contestant)
    heading = "" if table.by is By.CONTESTANT else f"{group.heading}: "
    counts = {"n": summary.n, "missing": summary.missing, "surplus": summary.surplus}
    remark = ", ".join(
        f"{word} {number}" for word, number in counts.items() if number or word == "n"
    )
    return f"{heading}{name} ({remark})"


_BOX_PLOTS = formats.drawings(draw_once(box_plot, group_sheet))
FORMATS = formats.table_formats(group_sheet) | _BOX_PLOTS


def draw_box_plots(pk: int) -> None:
    """Draw those of the job with that key, by each grouping, as far as no file keeps them."""
    job = GenerationJob.objects.get(pk=pk)
    for by in By:
        table = displacement_table(job, by=by)
        for form in _BOX_PLOTS.values():
            form.write(table)
