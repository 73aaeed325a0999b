"""A contact sheet: every contestant's picture side by side, scenario by scenario.

In: a rating and scenarios. Out: rows of pictures with their votes, and a PDF of them whose bytes
depend on the pictures, votes and names alone. Pictures are those that were shown, drawn before.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from arena.exports.charts.drawing import INK, SIMULATED, SOFT, house_style
from arena.exports.samples import stamp_simulated
from arena.exports.tables import LeaderboardTable, Row
from arena.models import Snapshot
from arena.queries.votes.evidence import PictureShown, sheet_rows
from augment.models import Scenario
from augment.services.scenarios.pictures import shrunken_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_IN = (11.69, 8.27)
"""A4, lying."""

_MARGIN_IN, _HEAD_IN, _CAPTION_IN, _LABEL_IN, _GAP_IN = 0.45, 0.35, 0.42, 0.2, 0.1
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
        high = _CAPTION_IN + lines * _LINE_IN
        if figure is None or top - high < _BOTTOM_IN:
            if figure is not None:
                yield figure
            figure = Figure(figsize=PAGE_IN)
            _head(figure, sheet)
            top = PAGE_IN[1] - _MARGIN_IN - _HEAD_IN
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
        bottom_in = top_in - _CAPTION_IN - line * _LINE_IN - _PICTURE_IN
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
