"""Sheets of pictures: samples of a job for a paper's figure, and a study's contact sheet."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from django.core.files.storage import default_storage

from arena.models import Snapshot
from arena.results.exports.drawing import (
    INK,
    NO_METADATA,
    SIMULATED,
    SOFT,
    house_style,
    write_figure,
)
from arena.results.exports.tables import Row, leaderboard_table, shown_name
from arena.results.queries.scores import PictureShown, pictures_by_scenario
from augment.errors import UnknownName
from augment.models import Augmentation, GenerationJob, Scenario
from augment.services.running.progress import cells_of
from augment.services.scenarios.pictures import shrunken_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHEET_FORMATS = ("pdf", "png")

_LEGEND = (
    "Ego vehicle red, changed agents blue. Every row has one camera for all its pictures. "
    "An unreadable or refused answer shows the unchanged scene."
)


# --- Samples of a job --------------------------------------------------------------------------


def find_cells(
    job: GenerationJob, *, scenarios: Sequence[str], contestants: Sequence[str], sample: int = 1
) -> dict[tuple[str, str], Augmentation]:
    """The cells of a job's sample by scenario and contestant.

    Raises:
        UnknownName: The job has no such scenario, contestant or sample.
    """
    cells = list(cells_of(job).filter(sample=sample))
    for kind, names, known in (
        ("sample of this job", [str(sample)], {str(n + 1) for n in range(job.samples)}),
        ("contestant of this job", contestants, {cell.contestant.slug for cell in cells}),
        ("scenario of this job", scenarios, {cell.scenario.slug for cell in cells}),
    ):
        for name in names:
            if name not in known:
                raise UnknownName(kind, name, sorted(known))
    return {(cell.scenario.slug, cell.contestant.slug): cell for cell in cells}


def sample_sheet(
    cells: Mapping[tuple[str, str], Augmentation],
    *,
    scenarios: Sequence[str],
    contestants: Sequence[str],
    file_format: str,
) -> bytes:
    """Scenarios down and contestants across, in the order in which they are named."""
    from matplotlib.figure import Figure

    columns = {cell.contestant.slug: cell.contestant for cell in cells.values()}
    rows = {cell.scenario.slug: cell.scenario for cell in cells.values()}
    across, down = len(contestants), len(scenarios)
    picture_in, head_in, foot_in = 3.2 * 2.0 / 3.0, 0.3, 0.28
    row_in = picture_in + 0.42
    wide, high = 3.2 * across, head_in + row_in * down + foot_in
    with house_style():
        figure = Figure(figsize=(wide, high))
        centred: dict[str, Any] = {"ha": "center", "va": "center"}
        for n, contestant in enumerate(columns[slug] for slug in contestants):
            figure.text(
                (n + 0.5) / across,
                1.0 - 0.55 * head_in / high,
                shown_name(contestant.name, contestant.is_simulated),
                fontsize=9,
                fontweight="bold",
                color=SIMULATED if contestant.is_simulated else INK,
                **centred,
            )
        for line, slug in enumerate(scenarios):
            bottom_in = high - head_in - row_in * line - picture_in
            for n, contestant_slug in enumerate(contestants):
                box = ((n + 0.01) / across, bottom_in / high, 0.98 / across, picture_in / high)
                _draw_sample(figure.add_axes(box), cells.get((slug, contestant_slug)))
            caption = _caption(chr(ord("a") + line % 26), rows[slug], across)
            y = (bottom_in - 0.06) / high
            figure.text(0.5, y, caption, ha="center", va="top", fontsize=8, color=INK)
        legend = textwrap.fill(_LEGEND, width=72 * across)
        figure.text(0.5, 0.09 / high, legend, ha="center", fontsize=6, color=SOFT)
        return write_figure(figure, file_format)


def _draw_sample(axes: Axes, cell: Augmentation | None) -> None:
    """Draw the cell's picture, or a word on why there is none."""
    from matplotlib.image import imread

    pixels = None
    if cell is not None and cell.image and default_storage.exists(cell.image):
        with default_storage.open(cell.image) as file:
            pixels = imread(io.BytesIO(file.read()), format="png")
    is_simulated = cell is not None and cell.contestant.is_simulated
    word = _explain(cell)
    _fill_frame(axes, pixels, word, is_simulated=is_simulated, size=24.0, line=0.5)
    if pixels is not None and word:
        axes.set_title(word, fontsize=7, color=SOFT, y=0.02, va="bottom")


def _explain(cell: Augmentation | None) -> str:
    if cell is None:
        return "not part of the job"
    if cell.state == Augmentation.State.DONE:
        return ""
    if cell.state in Augmentation.SHOWABLE:
        return f"{cell.get_state_display()}: unchanged scene"
    return f"no picture: {cell.get_state_display().lower()}"


def _caption(letter: str, scenario: Scenario, across: int) -> str:
    text = f"({letter}) {scenario.get_type_display()}: “{scenario.instruction.strip()}”"
    return "\n".join(textwrap.wrap(text, width=50 * across, max_lines=2, placeholder=" …"))


# --- The contact sheet -------------------------------------------------------------------------

_PAGE_IN = (11.69, 8.27)
"""A4, lying."""

_ACROSS, _MARGIN_IN, _CAPTION_IN, _GAP_IN = 5, 0.45, 0.42, 0.1
_CELL_IN = (_PAGE_IN[0] - 2 * _MARGIN_IN) / _ACROSS
_PICTURE_IN = (_CELL_IN - _GAP_IN) * 2.0 / 3.0
_LINE_IN = _PICTURE_IN + 0.26
_SHRUNK_PX = 600


def contact_sheet(snapshot: Snapshot, scenarios: Sequence[Scenario]) -> bytes:
    """Every contestant's picture on these scenarios with the votes on it, as a PDF of A4 pages."""
    from matplotlib.backends.backend_pdf import PdfPages

    content = io.BytesIO()
    with house_style(), PdfPages(content, metadata=NO_METADATA["pdf"]) as pages:
        for figure in _pages(snapshot, scenarios):
            pages.savefig(figure)
    return content.getvalue()


def _pages(snapshot: Snapshot, scenarios: Sequence[Scenario]) -> Iterator[Figure]:
    """One figure a page; a scenario whose cells don't fit any more begins a new one."""
    rows = leaderboard_table(snapshot).rows
    shown = pictures_by_scenario(snapshot, [scenario.pk for scenario in scenarios])
    high_in = _CAPTION_IN + -(-len(rows) // _ACROSS) * _LINE_IN
    first_in = _PAGE_IN[1] - _MARGIN_IN - 0.35
    figure, top_in = _new_page(snapshot), first_in
    for scenario in scenarios:
        if top_in - high_in < _MARGIN_IN and top_in < first_in:
            yield figure
            figure, top_in = _new_page(snapshot), first_in
        text = f"{scenario.slug}: {' '.join(scenario.instruction.split())}"
        lines = "\n".join(textwrap.wrap(text, width=170, max_lines=2))
        x, y = _MARGIN_IN / _PAGE_IN[0], top_in / _PAGE_IN[1]
        figure.text(x, y, lines, fontsize=7.5, color=INK, va="top")
        for n, row in enumerate(rows):
            line, column = divmod(n, _ACROSS)
            left_in = _MARGIN_IN + column * _CELL_IN
            bottom_in = top_in - _CAPTION_IN - line * _LINE_IN - _PICTURE_IN
            _draw_cell(figure, row, shown[scenario.pk].get(row.slug), left_in, bottom_in)
        top_in -= high_in + _GAP_IN
    yield figure


def _new_page(snapshot: Snapshot) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=_PAGE_IN)
    x, y = _MARGIN_IN / _PAGE_IN[0], 1.0 - _MARGIN_IN / _PAGE_IN[1]
    name = shown_name(snapshot.study.name, snapshot.includes_simulated)
    figure.text(x, y, name, fontsize=11, fontweight="bold", color=INK, va="top")
    rating = str(snapshot.code)[:8]
    text = f"Rating {rating}. Beneath each picture: votes won, tied, lost."
    figure.text(1.0 - x, y, text, fontsize=7, color=SOFT, ha="right", va="top")
    return figure


def _draw_cell(
    figure: Figure, row: Row, picture: PictureShown | None, left_in: float, bottom_in: float
) -> None:
    wide, high = _PAGE_IN
    width_in = _CELL_IN - _GAP_IN
    box = (left_in / wide, bottom_in / high, width_in / wide, _PICTURE_IN / high)
    pixels = None if picture is None else shrunken_picture(picture.image, _SHRUNK_PX)
    word = "no votes" if picture is None else "no picture"
    _fill_frame(
        figure.add_axes(box), pixels, word, is_simulated=row.simulated, size=14.0, line=0.4
    )
    name = textwrap.shorten(row.model, width=38, placeholder="…")
    below: dict[str, Any] = {"y": (bottom_in - 0.05) / high, "fontsize": 6.5, "va": "top"}
    figure.text(left_in / wide, s=name, color=SIMULATED if row.simulated else INK, **below)
    if picture is not None:
        score = f"{picture.score.wins}, {picture.score.ties}, {picture.score.losses}"
        figure.text((left_in + width_in) / wide, s=score, color=SOFT, ha="right", **below)


def _fill_frame(
    axes: Axes, pixels: Any | None, word: str, *, is_simulated: bool, size: float, line: float
) -> None:
    """Draw a picture or a word instead; a simulated one is stamped, as it may be cut out."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_color(SOFT)
    axes.spines[:].set_linewidth(line)
    centred: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "center"}
    if pixels is None:
        axes.text(0.5, 0.5, word, fontsize=7.5, color=SOFT, **centred)
        return
    axes.imshow(pixels)
    if is_simulated:
        axes.text(
            0.5,
            0.5,
            "SIMULATED",
            rotation=25,
            fontsize=size,
            fontweight="bold",
            color=SIMULATED,
            alpha=0.3,
            **centred,
        )
