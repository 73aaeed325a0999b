"""Sheets of pictures: samples of a job for a paper's figure."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from django.core.files.storage import default_storage

from arena.exports.cells import show_name
from arena.exports.drawing import INK, SIMULATED, SOFT, chart_style, write_figure
from augment.errors import check_names
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.running import list_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET_FORMATS = ("pdf", "png")

_LEGEND = (
    "Ego vehicle red, changed agents blue. Every row has one camera for all its pictures. "
    "An unreadable or refused answer shows the unchanged scene."
)


def find_cells(
    job: GenerationJob, *, scenarios: Sequence[str], contestants: Sequence[str], sample: int = 1
) -> dict[tuple[str, str], Augmentation]:
    """Return the cells of a job's sample by scenario and contestant.

    Raises:
        UnknownName: The job has no such scenario, contestant or sample.
    """
    cells = list(list_cells(job).filter(sample=sample))
    for kind, names, allowed in (
        ("sample of this job", [str(sample)], {str(n + 1) for n in range(job.samples)}),
        ("contestant of this job", contestants, {cell.contestant.slug for cell in cells}),
        ("scenario of this job", scenarios, {cell.scenario.slug for cell in cells}),
    ):
        check_names(kind, names, sorted(allowed))
    return {(cell.scenario.slug, cell.contestant.slug): cell for cell in cells}


def sample_sheet(
    cells: Mapping[tuple[str, str], Augmentation],
    *,
    scenarios: Sequence[str],
    contestants: Sequence[str],
    file_format: str,
) -> bytes:
    """Draw scenarios down and contestants across, in the order in which they are named."""
    from matplotlib.figure import Figure

    shown = {cell.contestant.slug: cell.contestant for cell in cells.values()}
    rows = {cell.scenario.slug: cell.scenario for cell in cells.values()}
    across, down = len(contestants), len(scenarios)
    with chart_style():
        figure = Figure(figsize=(3.2 * across, 0.4 + 2.75 * down), layout="constrained")
        parts = figure.subfigures(down, 1, squeeze=False).flat
        for line, (part, slug) in enumerate(zip(parts, scenarios, strict=True)):
            scenario = rows[slug]
            text = f"{scenario.get_type_display()}: “{scenario.wording.strip()}”"
            caption = f"({chr(ord('a') + line % 26)}) {text}"
            wrapped = textwrap.wrap(caption, 50 * across, max_lines=2, placeholder=" …")
            part.suptitle("\n".join(wrapped), fontsize=8)
            grid = part.subplots(1, across, squeeze=False).flat
            for axes, name in zip(grid, contestants, strict=True):
                _draw_tile(axes, shown[name], cells.get((slug, name)))
        figure.supxlabel(textwrap.fill(_LEGEND, width=72 * across), fontsize=6, color=SOFT)
        return write_figure(figure, file_format)


def _explain(cell: Augmentation | None) -> str:
    if cell is None:
        return "not part of the job"
    if cell.state == Augmentation.State.DONE:
        return ""
    if cell.state in Augmentation.SHOWABLE:
        shown = "the answer before" if cell.is_answer else "unchanged scene"
        return f"{cell.get_state_display()}: {shown}"
    return f"no picture: {cell.get_state_display().lower()}"


def _draw_tile(axes: Axes, contestant: Contestant, cell: Augmentation | None) -> None:
    """Draw a picture or why there is none; a simulated one is stamped, as it may be cut out."""
    from matplotlib.image import imread

    is_simulated, word = contestant.is_simulated, _explain(cell)
    axes.set_title(show_name(contestant), fontsize=7, color=SIMULATED if is_simulated else INK)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set(visible=True, color=SOFT, linewidth=0.5)
    centred: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "center"}
    if cell is None or not cell.image or not default_storage.exists(cell.image):
        axes.text(0.5, 0.5, word, color=SOFT, **centred)
        return
    with default_storage.open(cell.image) as file:
        axes.imshow(imread(io.BytesIO(file.read()), format="png"))
    axes.set_xlabel(word, fontsize=7, color=SOFT)
    if is_simulated:
        stamp: dict[str, Any] = {"rotation": 25, "fontsize": 14, "fontweight": "bold"}
        axes.text(0.5, 0.5, "SIMULATED", color=SIMULATED, alpha=0.3, **stamp, **centred)
