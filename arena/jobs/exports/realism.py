"""The realism of a job's contestants: what its files and page show."""

from functools import partial
from typing import Any

from arena.exports.cells import show_name
from arena.exports.formats import Columns, Dtype, Sheet, formats, make_sheet, table_formats
from arena.exports.latex import ValueColumns, latex_values
from arena.jobs.exports.displacement import SIMULATED_NOTE
from augment.models import GenerationJob
from augment.services.judging import RANDOM_DRAWS, RealismLine, RealismTable, realism_of_job
from augment.services.judging.realism import SCORES, Subject


def realism_notes(table: RealismTable) -> list[str]:
    """Return the sentences that belong beneath every form of the table."""
    notes = {
        f"Realism, version {table.version}: how likely speed, heading to the lane, gap to the "
        "nearest, distance to the road's edge of what was placed are among recorded objects of "
        "the class, and which share collides with nobody; 0 to 1, the mean of the five.": True,
        "Recorded there: recorded traffic in the scenes in which this line could be judged.": True,
        f"Learned from {table.scenes} scenes of this installation, never from the scene itself; "
        f"objects at random are placed {RANDOM_DRAWS} times in the picture's window.": True,
        "Recorded traffic is the upper and random placement the lower end of a fair comparison; "
        "objects that all stand in the most usual way can lie above.": True,
        "Not judged: answers without an object, and classes that were hardly recorded.": True,
        SIMULATED_NOTE: any(line.is_simulated for line in table.lines),
    }
    return [note for note, holds in notes.items() if holds]


def realism_context(job: GenerationJob) -> dict[str, Any]:
    """Return the answer in a sentence and the table, as the job's page shows them."""
    table = realism_of_job(job)
    return {
        "answer": answer_in_words(table),
        "lines": [(line, [line.scores.get(name) for name in SCORES]) for line in table.lines],
        "scores": SCORES,
        "notes": realism_notes(table),
        "forms": FORMATS,
    }


def answer_in_words(table: RealismTable) -> str:
    """Return who is most realistic and where that lies, as a sentence."""
    best = next((line for line in table.lines if line.subject is Subject.CONTESTANT), None)
    if best is None or best.mean is None:
        return "No contestant placed anything that could be judged."
    recorded = "--" if best.recorded is None else f"{best.recorded:.2f}"
    return (
        f"The most realistic is {show_name(best)} with {best.mean:.2f} over {best.changes} "
        f"changes; recorded traffic has {recorded} in the same scenes."
    )


def _score(name: str, line: RealismLine) -> float | None:
    return line.scores.get(name)


COLUMNS: Columns = {
    "row": ("subject", Dtype.TEXT),
    "name": (show_name, Dtype.TEXT),
    **Dtype.TEXT.columns("slug", "model", "variant", of="contestant"),
    "simulated": ("is_simulated", Dtype.YES_NO),
    "realism": ("mean", Dtype.NUMBER),
    "recorded_there": ("recorded", Dtype.NUMBER),
    **{name: (partial(_score, name), Dtype.NUMBER) for name in SCORES},
    **Dtype.WHOLE.columns("changes", "left_out", "objects"),
}


def realism_sheet(table: RealismTable) -> Sheet:
    """Return the recorded traffic, the reference, each contestant and random placement."""
    facts = {
        "job": table.job,
        "realism_version": table.version,
        "scenes": table.scenes,
        "notes": realism_notes(table),
    }
    columns: Columns = {**COLUMNS, "version": (lambda line: table.version, Dtype.WHOLE)}
    return make_sheet(table.lines, columns, name="realism", key="lines", number=".4f", facts=facts)


def realism_latex(table: RealismTable) -> bytes:
    """Return the same as a LaTeX table."""
    columns: ValueColumns = {
        "Changes": show_name,
        "Realism": lambda line: line.mean,
        "Recorded there": lambda line: line.recorded,
        **{name.capitalize(): partial(_score, name) for name in SCORES},
        "n": lambda line: line.changes,
    }
    return latex_values(
        table.lines,
        columns,
        comments=realism_notes(table),
        caption=f"Realism (version {table.version}), 0 to 1; n: changes.",
        label="tab:realism",
    )


FORMATS = table_formats(realism_sheet) | formats(latex=realism_latex)
