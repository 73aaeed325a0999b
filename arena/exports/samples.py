"""A sheet of pictures, scenarios down and contestants across: the paper's qualitative figure."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from django.core.files.storage import default_storage

from arena.exports.charts.drawing import INK, SIMULATED, SOFT, house_style, write_figure
from arena.exports.tables import SIMULATED as SIMULATED_WORD
from augment.errors import UnknownName
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services.running.progress import cells_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET_FORMATS = ("pdf", "png")

_WIDTH_IN, _HEIGHT_IN = 3.2, 3.2 * 2.0 / 3.0
_CAPTION_IN, _HEAD_IN, _FOOT_IN = 0.42, 0.3, 0.28
_LEGEND = (
    "Ego vehicle red, changed agents blue. Every row has one camera for all its pictures. "
    "An unreadable or refused answer shows the unchanged scene."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetRow:
    """One scenario with its cells, None where nothing was planned."""

    scenario: Scenario
    cells: list[Augmentation | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """What is on the sheet, in its order."""

    job: str
    contestants: tuple[Contestant, ...]
    rows: tuple[SheetRow, ...]


def sheet_of(
    job: GenerationJob, *, scenarios: Sequence[str], contestants: Sequence[str], sample: int = 1
) -> Sheet:
    """Return the chosen cells of a job, in the order in which they were named.

    Raises:
        UnknownName: The job has no such scenario, contestant or sample.
    """
    cells = list(cells_of(job).filter(sample=sample))
    across = {cell.contestant.slug: cell.contestant for cell in cells}
    down = {cell.scenario.slug: cell.scenario for cell in cells}
    samples = [str(number) for number in range(1, job.samples + 1)]
    for kind, names, known in (
        ("sample of this job", [str(sample)], samples),
        ("contestant of this job", contestants, sorted(across)),
        ("scenario of this job", scenarios, sorted(down)),
    ):
        for name in names:
            if name not in known:
                raise UnknownName(kind, name, list(known))
    by_place = {(cell.scenario.slug, cell.contestant.slug): cell for cell in cells}
    return Sheet(
        job=job.name,
        contestants=tuple(across[slug] for slug in contestants),
        rows=tuple(
            SheetRow(scenario=down[slug], cells=[by_place.get((slug, who)) for who in contestants])
            for slug in scenarios
        ),
    )


def sheet_bytes(sheet: Sheet, *, file_format: str) -> bytes:
    """The sheet as a file.

    Args:
        sheet: At least one scenario and one contestant.
        file_format: "pdf" or "png".
    """
    from matplotlib.figure import Figure

    across, down = len(sheet.contestants), len(sheet.rows)
    row_in = _HEIGHT_IN + _CAPTION_IN
    size = (_WIDTH_IN * across, _HEAD_IN + row_in * down + _FOOT_IN)
    with house_style():
        figure = Figure(figsize=size)
        for n, contestant in enumerate(sheet.contestants):
            is_simulated = contestant.is_simulated
            figure.text(
                (n + 0.5) / across,
                1.0 - 0.55 * _HEAD_IN / size[1],
                contestant.name + (SIMULATED_WORD if is_simulated else ""),
                ha="center",
                va="center",
                fontsize=9,
                fontweight="bold",
                color=SIMULATED if is_simulated else INK,
            )
        for line, row in enumerate(sheet.rows):
            top_in = size[1] - _HEAD_IN - row_in * line
            for n, cell in enumerate(row.cells):
                left = (n + 0.01) / across
                place = (
                    left,
                    (top_in - _HEIGHT_IN) / size[1],
                    0.98 / across,
                    _HEIGHT_IN / size[1],
                )
                _picture(figure.add_axes(place), cell)
            caption = _caption(chr(ord("a") + line % 26), row, across)
            middle = (top_in - _HEIGHT_IN - 0.06) / size[1]
            figure.text(0.5, middle, caption, ha="center", va="top", fontsize=8, color=INK)
        figure.text(0.5, 0.09 / size[1], _legend(across), ha="center", fontsize=6, color=SOFT)
        return write_figure(figure, file_format)


def stamp_simulated(axes: Axes, *, size: float = 24.0) -> None:
    """A word across a picture that somebody may cut out of the sheet."""
    axes.text(
        0.5,
        0.5,
        "SIMULATED",
        transform=axes.transAxes,
        ha="center",
        va="center",
        rotation=25,
        fontsize=size,
        fontweight="bold",
        color=SIMULATED,
        alpha=0.3,
    )


# Private


def _picture(axes: Axes, cell: Augmentation | None) -> None:
    """The cell's picture, or a word on why there is none."""
    from matplotlib.image import imread

    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_color(SOFT)
    axes.spines[:].set_linewidth(0.5)
    if cell is not None and cell.image and default_storage.exists(cell.image):
        with default_storage.open(cell.image) as file:
            axes.imshow(imread(io.BytesIO(file.read()), format="png"))
        if cell.contestant.is_simulated:
            stamp_simulated(axes)
        if cell.state != Augmentation.State.DONE:
            axes.set_title(_word(cell), fontsize=7, color=SOFT, y=0.02, va="bottom")
        return
    axes.text(0.5, 0.5, _word(cell), ha="center", va="center", fontsize=8, color=SOFT)


def _word(cell: Augmentation | None) -> str:
    if cell is None:
        return "not part of the job"
    if cell.state in Augmentation.SHOWABLE and cell.state != Augmentation.State.DONE:
        return f"{cell.get_state_display()}: unchanged scene"
    return f"no picture: {cell.get_state_display().lower()}"


def _caption(letter: str, row: SheetRow, across: int) -> str:
    text = f"({letter}) {row.scenario.get_type_display()}: “{row.scenario.instruction.strip()}”"
    return "\n".join(textwrap.wrap(text, width=50 * across, max_lines=2, placeholder=" …"))


def _legend(across: int) -> str:
    return "\n".join(textwrap.wrap(_LEGEND, width=72 * across))
