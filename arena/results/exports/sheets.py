"""A sheet of pictures, scenarios down and contestants across: the paper's qualitative figure."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from django.core.files.storage import default_storage

from arena.models import Snapshot
from arena.queries.jobs import GridRow, JobGrid
from arena.results.exports.charts import INK, SIMULATED, SOFT, house_style, write_figure
from arena.results.exports.tables import SIMULATED as SIMULATED_WORD
from arena.results.exports.tables import LeaderboardTable, Row
from arena.results.queries.evidence import PictureShown, sheet_rows
from augment.errors import UnknownName
from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios.pictures import shrunken_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SHEET_FORMATS = ("pdf", "png")

_WIDTH_IN, _HEIGHT_IN = 3.2, 3.2 * 2.0 / 3.0
_CAPTION_IN, _HEAD_IN, _FOOT_IN = 0.42, 0.3, 0.28
_LEGEND = (
    "Ego vehicle red, changed agents blue. Every row has one camera for all its pictures. "
    "An unreadable or refused answer shows the unchanged scene."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """What is on the sheet, in its order."""

    job: str
    contestants: tuple[Contestant, ...]
    rows: tuple[GridRow, ...]


def sheet_of(
    job: str, grid: JobGrid, *, scenarios: Sequence[str], contestants: Sequence[str]
) -> Sheet:
    """The chosen cells of a job's grid, in the order in which they were named.

    Raises:
        UnknownName: The job has no such scenario or contestant.
    """
    columns = {contestant.slug: n for n, contestant in enumerate(grid.contestants)}
    lines = {row.scenario.slug: row for row in grid.rows}
    for kind, names, known in (
        ("contestant of this job", contestants, columns),
        ("scenario of this job", scenarios, lines),
    ):
        for name in names:
            if name not in known:
                raise UnknownName(kind, name, list(known))
    chosen = [columns[slug] for slug in contestants]
    return Sheet(
        job=job,
        contestants=tuple(grid.contestants[n] for n in chosen),
        rows=tuple(
            GridRow(scenario=lines[slug].scenario, cells=[lines[slug].cells[n] for n in chosen])
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


def _caption(letter: str, row: GridRow, across: int) -> str:
    text = f"({letter}) {row.scenario.get_type_display()}: “{row.scenario.instruction.strip()}”"
    return "\n".join(textwrap.wrap(text, width=50 * across, max_lines=2, placeholder=" …"))


def _legend(across: int) -> str:
    return "\n".join(textwrap.wrap(_LEGEND, width=72 * across))


PAGE_IN = (11.69, 8.27)
"""A4, lying."""

_MARGIN_IN, _HEAD_IN_contact_sheet, _CAPTION_IN_contact_sheet, _LABEL_IN, _GAP_IN = (
    0.45,
    0.35,
    0.42,
    0.2,
    0.1,
)
_ACROSS = 5
_CELL_IN = (PAGE_IN[0] - 2 * _MARGIN_IN) / _ACROSS
_PICTURE_IN = (_CELL_IN - _GAP_IN) * 2.0 / 3.0
_LINE_IN = _PICTURE_IN + _LABEL_IN + 0.06
_SHRUNK_PX = 600
_BOTTOM_IN = _MARGIN_IN


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetCell:
    """A contestant on a scenario; without a picture nobody judged one."""

    row: Row
    picture: PictureShown | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetRow:
    """A scenario with its cells in the order of the table."""

    scenario: Scenario
    cells: tuple[SheetCell, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactSheet:
    """What is on the sheet, and what stands above it."""

    study: str
    rating: str
    simulated: bool
    rows: tuple[SheetRow, ...]


def contact_sheet(
    snapshot: Snapshot, table: LeaderboardTable, scenarios: Sequence[Scenario]
) -> ContactSheet:
    """The pictures of these scenarios; three queries."""
    found = sheet_rows(snapshot, [one.pk for one in scenarios])
    return ContactSheet(
        study=snapshot.study.name,
        rating=str(snapshot.code),
        simulated=snapshot.includes_simulated,
        rows=tuple(
            SheetRow(
                scenario=one,
                cells=tuple(
                    SheetCell(row=row, picture=found[one.pk].get(row.slug)) for row in table.rows
                ),
            )
            for one in scenarios
        ),
    )


def sheet_pdf(sheet: ContactSheet) -> bytes:
    """The sheet as pages of A4."""
    from matplotlib.backends.backend_pdf import PdfPages

    content = io.BytesIO()
    nothing = {"CreationDate": None, "Creator": None, "Producer": None}
    with house_style(), PdfPages(content, metadata=nothing) as pages:
        for figure in _pages(sheet):
            pages.savefig(figure)
    return content.getvalue()


# --- Private -----------------------------------------------------------------------------------


def _pages(sheet: ContactSheet) -> Iterator[Figure]:
    """One figure a page; a scenario whose cells don't fit any more begins a new one."""
    from matplotlib.figure import Figure

    figure, top = None, 0.0
    for row in sheet.rows:
        lines = -(-len(row.cells) // _ACROSS)
        high = _CAPTION_IN_contact_sheet + lines * _LINE_IN
        if figure is None or top - high < _BOTTOM_IN:
            if figure is not None:
                yield figure
            figure = Figure(figsize=PAGE_IN)
            _head(figure, sheet)
            top = PAGE_IN[1] - _MARGIN_IN - _HEAD_IN_contact_sheet
        _row(figure, row, top)
        top -= high + _GAP_IN
    if figure is None:
        figure = Figure(figsize=PAGE_IN)
        _head(figure, sheet)
    yield figure


def _head(figure: Figure, sheet: ContactSheet) -> None:
    y = 1.0 - _MARGIN_IN / PAGE_IN[1]
    x = _MARGIN_IN / PAGE_IN[0]
    mark = " (simulated)" if sheet.simulated else ""
    figure.text(x, y, f"{sheet.study}{mark}", fontsize=11, fontweight="bold", color=INK, va="top")
    said = f"Rating {sheet.rating[:8]}. Beneath each picture: votes won, tied, lost."
    figure.text(1.0 - x, y, said, fontsize=7, color=SOFT, ha="right", va="top")


def _row(figure: Figure, row: SheetRow, top_in: float) -> None:
    instruction = " ".join(row.scenario.instruction.split())
    said = textwrap.wrap(f"{row.scenario.slug}: {instruction}", width=170, max_lines=2)
    figure.text(
        _MARGIN_IN / PAGE_IN[0], top_in / PAGE_IN[1], "\n".join(said), fontsize=7.5, color=INK,
        va="top",
    )  # fmt: skip
    for n, cell in enumerate(row.cells):
        line, column = divmod(n, _ACROSS)
        left_in = _MARGIN_IN + column * _CELL_IN
        bottom_in = top_in - _CAPTION_IN_contact_sheet - line * _LINE_IN - _PICTURE_IN
        _cell(figure, cell, left_in, bottom_in)


def _cell(figure: Figure, cell: SheetCell, left_in: float, bottom_in: float) -> None:
    wide, high = PAGE_IN
    axes = figure.add_axes(
        (left_in / wide, bottom_in / high, (_CELL_IN - _GAP_IN) / wide, _PICTURE_IN / high)
    )
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_color(SOFT)
    axes.spines[:].set_linewidth(0.4)
    picture = cell.picture
    colours = None if picture is None else shrunken_picture(picture.image, _SHRUNK_PX)
    if picture is None:
        axes.text(0.5, 0.5, "no votes", ha="center", va="center", fontsize=7, color=SOFT)
    elif colours is None:
        axes.text(0.5, 0.5, "no picture", ha="center", va="center", fontsize=7, color=SOFT)
    else:
        axes.imshow(colours)
        if cell.row.simulated:
            stamp_simulated(axes, size=14)
    score = "" if picture is None else _score(picture)
    name = textwrap.shorten(cell.row.model, width=38, placeholder="…")
    colour = SIMULATED if cell.row.simulated else INK
    y = (bottom_in - 0.05) / high
    right_in = left_in + _CELL_IN - _GAP_IN
    figure.text(left_in / wide, y, name, fontsize=6.5, color=colour, va="top")
    figure.text(right_in / wide, y, score, fontsize=6.5, color=SOFT, ha="right", va="top")


def _score(picture: PictureShown) -> str:
    score = picture.score
    return f"{score.wins}, {score.ties}, {score.losses}"
