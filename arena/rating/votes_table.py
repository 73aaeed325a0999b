"""The table in a file of votes: its columns, and where it is not what it should be."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from arena.rating.comparisons import LOSS, TIE, WIN
from arena.rating.tabular import TextTable, fit_row, open_table

NEEDED = ("model_a", "model_b", "winner")
OPTIONAL = ("judge", "item")
SIDE = "side"
"""A covariate that every file has: `model_a` was on the left."""
WINNERS = {"model_a": WIN, "model_b": LOSS, "tie": TIE, "tie (bothbad)": TIE}


class VotesFileUnreadable(ValueError):
    """The file is not what it should be; the text has the line and what is allowed."""


def columns_of(path: Path) -> tuple[str, ...]:
    """The columns that the file has beside the needed ones.

    Raises:
        VotesFileUnreadable: The first line does not name the needed columns, each once.
    """
    with open_votes(path) as table:
        return tuple(name for name in table.header if name not in NEEDED)


@contextmanager
def open_votes(path: Path) -> Iterator[TextTable]:
    """The table of a file that has the needed columns, each once.

    Raises:
        VotesFileUnreadable: It has not, or can't be read at all.
    """
    try:
        opened = open_table(path, (*NEEDED, *OPTIONAL))
        table = opened.__enter__()
    except (StopIteration, RuntimeError):
        raise VotesFileUnreadable(f"line 1: the file is empty; {_columns_text()}") from None
    except (csv.Error, ValueError) as error:
        raise VotesFileUnreadable(f"line 1: {error}; {_columns_text()}") from error
    try:
        _check_header(table.header)
        yield table
    finally:
        opened.__exit__(None, None, None)


def line_of(path: Path, column: str, name: str) -> int:
    """The first line with a name in a column."""
    with open_votes(path) as table:
        place = table.header.index(column)
        before = table.lines_read()
        for row in table.rows:
            if row and row[place].strip() == name:
                break
            before = table.lines_read()
    return before + 1


def explain(path: Path, wanted: Sequence[str]) -> None:
    """Raise for the first line that is wrong, and say what is allowed."""
    with open_votes(path) as table:
        places = {name: table.header.index(name) for name in wanted}
        before = table.lines_read()
        while True:
            try:
                row = next(table.rows, None)
            except (csv.Error, ValueError) as error:
                raise VotesFileUnreadable(f"line {before + 1}: {error}") from error
            if row is None:
                return
            if row and (wrong := _wrong(row, len(table.header), places)):
                raise VotesFileUnreadable(f"line {before + 1}: {wrong}")
            before = table.lines_read()


def is_missing(name: str) -> bool:
    """Whether a cell says nothing: empty, or what other programs write for that."""
    return not name or name.lower() == "nan"


# --- Private -----------------------------------------------------------------------------------


def _check_header(header: Sequence[str]) -> None:
    for name in NEEDED:
        if name not in header:
            raise VotesFileUnreadable(f"line 1: there is no column {name!r}; {_columns_text()}")
    twice = [name for name in (*NEEDED, *OPTIONAL) if header.count(name) > 1]
    if twice:
        raise VotesFileUnreadable(f"line 1: the column {twice[0]!r} is there twice")


def _columns_text() -> str:
    return f"needed are {', '.join(NEEDED)}, allowed besides {' and '.join(OPTIONAL)}"


def _wrong(row: list[str], width: int, places: dict[str, int]) -> str:
    """What is wrong with a line, empty if nothing is."""
    row = fit_row(row, width)
    if len(row) != width:
        return f"there are {len(row)} cells, in the first line {width}"
    cells = {name: row[place].strip() for name, place in places.items()}
    empty = [name for name, cell in cells.items() if is_missing(cell)]
    if empty:
        found = cells[empty[0]]
        return f"{empty[0]} is {found!r}, which is no name" if found else f"{empty[0]} is empty"
    if cells["winner"] not in WINNERS:
        return f"the winner {cells['winner']!r} is none of {', '.join(WINNERS)}"
    if cells["model_a"] == cells["model_b"]:
        return f"{cells['model_a']!r} is compared with itself"
    return ""
