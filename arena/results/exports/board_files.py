"""The files of a board: each table as HTML, CSV, JSON and a chart, and a page of all of them.

In: documents of tables. Out: files that any web host can serve and that open from a folder; they
need nothing from elsewhere and have no scripts. The files of a table are written once, when it is
published; the folder has them as they were.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from django.template.loader import render_to_string

from arena.exports.files import write_whole
from arena.exports.formats import json_bytes, make_sheet, sheet_csv
from arena.exports.leaderboard import BOARD, file_columns
from arena.models import Board
from arena.rating.board_table import BoardTableDocument
from arena.results.exports.charts import rows_chart

STYLE, INDEX = "board.css", "index.html"


def write_table(table: BoardTableDocument) -> dict[str, str]:
    """Write the files of a table, by their endings."""
    simulated = " (simulated)" if table.includes_simulated else ""
    chart = rows_chart(table.lines, f"Elo with 95 % intervals{simulated}", file_format="svg")
    sheet = make_sheet(table.lines, file_columns(BOARD, table), name="board-table")
    return {
        "json": json_bytes(asdict(table)).decode(),
        "csv": sheet_csv(sheet).decode(),
        "svg": chart.decode(),
        "html": render_to_string("boards/frozen.html", _table_context(table)),
    }


def board_folder(board: Board) -> dict[str, bytes]:
    """Return the files of all tables and a page that shows the newest and links to the others."""
    tables = list(board.tables.all())
    page = {"title": board.name, "tables": tables}
    if tables:
        page = _table_context(tables[0].document) | page
    files = {
        f"table-{table.number}.{form}": text.encode()
        for table in tables
        for form, text in table.files.items()
    }
    return files | {
        INDEX: render_to_string("boards/frozen.html", page).encode(),
        STYLE: render_to_string("boards/board.css").encode(),
    }


def write_folder(files: Mapping[str, bytes], out: Path) -> None:
    """Write files into a folder, which may have an earlier export.

    Raises:
        OSError: It can't be written to.
    """
    out.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        write_whole(out / name, content)


def _table_context(table: BoardTableDocument) -> dict[str, Any]:
    """Return the table as the template shows it; its chart is a file of its own."""
    rows = [(line, None) for line in table.lines]
    return {"title": table.board, "table": table, "rows": rows}
