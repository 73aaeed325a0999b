"""Sheets of pictures: samples of a job for a paper's figure."""

from __future__ import annotations

import io
import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from django.core.files.storage import default_storage

from arena.exports.cells import show_name
from arena.exports.drawing import INK, SIMULATED, SOFT, chart_style, write_figure
from augment.errors import check_names
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.running import list_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

SHEET_FORMATS = ("pdf", "png")

_LEGEND = (
    "Ego vehicle red, changed agents blue. Every row has one camera for all its pictures. "
    "An unreadable or refused answer shows the unchanged scene."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """A picture with its title.

    Attributes:
        pixels: None without a picture.
        word: Why there is none.
        note: What is said of it, beneath.
    """

    title: str
    is_simulated: bool
    pixels: Any | None = None
    word: str = ""
    note: str = ""


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
            tiles = [_sample_tile(shown[name], cells.get((slug, name))) for name in contestants]
            _draw_tiles(part, _wrap(caption, 50 * across), tiles, across)
        figure.supxlabel(textwrap.fill(_LEGEND, width=72 * across), fontsize=6, color=SOFT)
        return write_figure(figure, file_format)


def _sample_tile(contestant: Contestant, cell: Augmentation | None) -> Tile:
    """Return the cell's picture, or a word on why there is none."""
    from matplotlib.image import imread

    pixels = None
    if cell is not None and cell.image and default_storage.exists(cell.image):
        with default_storage.open(cell.image) as file:
            pixels = imread(io.BytesIO(file.read()), format="png")
    word = _explain(cell)
    return Tile(
        title=show_name(contestant),
        is_simulated=contestant.is_simulated,
        pixels=pixels,
        word=word,
        note=word,
    )


def _explain(cell: Augmentation | None) -> str:
    if cell is None:
        return "not part of the job"
    if cell.state == Augmentation.State.DONE:
        return ""
    if cell.state in Augmentation.SHOWABLE:
        shown = "the answer before" if cell.is_answer else "unchanged scene"
        return f"{cell.get_state_display()}: {shown}"
    return f"no picture: {cell.get_state_display().lower()}"


def _wrap(caption: str, width: int) -> str:
    return "\n".join(textwrap.wrap(caption, width=width, max_lines=2, placeholder=" …"))


def _draw_tiles(part: SubFigure, caption: str, tiles: Sequence[Tile], across: int) -> None:
    part.suptitle(caption, fontsize=8)
    grid = list(part.subplots(math.ceil(len(tiles) / across), across, squeeze=False).flat)
    for axes, tile in zip(grid, tiles, strict=False):
        _draw_tile(axes, tile)
    for axes in grid[len(tiles) :]:
        axes.set_visible(False)


def _draw_tile(axes: Axes, tile: Tile) -> None:
    """Draw a picture or a word instead; a simulated one is stamped, as it may be cut out."""
    axes.set_title(tile.title, fontsize=7, color=SIMULATED if tile.is_simulated else INK)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set(visible=True, color=SOFT, linewidth=0.5)
    centred: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "center"}
    if tile.pixels is None:
        axes.text(0.5, 0.5, tile.word, color=SOFT, **centred)
        return
    axes.imshow(tile.pixels)
    axes.set_xlabel(tile.note, fontsize=7, color=SOFT)
    if tile.is_simulated:
        stamp: dict[str, Any] = {
            "rotation": 25,
            "fontsize": 14,
            "fontweight": "bold",
            "alpha": 0.3,
        }
        axes.text(0.5, 0.5, "SIMULATED", color=SIMULATED, **stamp, **centred)
