"""Votes from a file with the columns model_a, model_b, winner, and maybe judge and item.

A quick pass reads blocks of lines into numbers and only notices that something is wrong; a slow
one, line by line, then finds where and says it. Millions of lines take seconds and little memory:
no text is kept but the names.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, IntArray
from arena.rating.tabular import TextTable, fit_row, open_table

NEEDED = ("model_a", "model_b", "winner")
OPTIONAL = ("judge", "item")
WINNERS = {"model_a": WIN, "model_b": LOSS, "tie": TIE, "tie (bothbad)": TIE}

_LINES_AT_ONCE = 20_000
_ROWS_BEFORE_GROUPING = 500_000
_LARGEST_KEY = 2**62

Rows = NDArray[np.int32]
_HALF_POINTS = {winner: round(2 * score) for winner, score in WINNERS.items()}


class VotesFileUnreadable(ValueError):
    """The file is not what it should be; the text has the line and what is allowed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VotesFile:
    """What a file holds.

    Attributes:
        comparisons: Its votes, experts are judges, scenarios items. A column that was not asked
            for is one judge or item for all; without either, equal votes are in one row.
        repeats: How many votes repeat an earlier one of the same judge, item and pair; None where
            these were not asked for.
    """

    comparisons: Comparisons
    repeats: int | None


def columns_of(path: Path) -> tuple[str, ...]:
    """The optional columns that the file has.

    Raises:
        VotesFileUnreadable: The first line does not name the needed columns, each once.
    """
    with open_votes(path) as table:
        return tuple(name for name in OPTIONAL if name in table.header)


def read_votes(path: Path, *, clusters: Sequence[str]) -> VotesFile:
    """Read all votes.

    Args:
        path: CSV, JSON lines or Parquet; text in UTF-8 or UTF-16.
        clusters: Which of the optional columns to read; every line must fill them.

    Raises:
        VotesFileUnreadable: A column is missing, a winner is unknown, a cell that is needed is
            empty, a model meets itself, or a line has more or fewer cells than the first.
    """
    wanted = (*NEEDED, *clusters)
    names = [_Codes() for _ in range(1 + len(clusters))]
    try:
        rows, counts = _read(path, wanted, names)
    except VotesFileUnreadable:
        raise
    except (ValueError, KeyError, csv.Error) as error:
        _explain(path, wanted)
        raise VotesFileUnreadable(f"{path}: {error}") from error
    return _as_votes(rows, counts, clusters, names)


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


class _Codes(dict[str, int]):
    """Numbers names as they come, without the spaces around them."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def __missing__(self, cell: str) -> int:
        name = cell.strip()
        if is_missing(name):
            raise ValueError("a cell is empty")
        if name == cell:
            self.names.append(name)
            number = len(self.names) - 1
        else:
            number = self[name]
        self[cell] = number
        return number


class _Winners(dict[str, int]):
    """Half points of the first by the winner's name."""

    def __missing__(self, cell: str) -> int:
        number = self[cell] = _HALF_POINTS[cell.strip()]
        return number


def is_missing(name: str) -> bool:
    """Whether a cell says nothing: empty, or what other programs write for that."""
    return not name or name.lower() == "nan"


def _check_header(header: Sequence[str]) -> None:
    for name in NEEDED:
        if name not in header:
            raise VotesFileUnreadable(f"line 1: there is no column {name!r}; {_columns_text()}")
    twice = [name for name in (*NEEDED, *OPTIONAL) if header.count(name) > 1]
    if twice:
        raise VotesFileUnreadable(f"line 1: the column {twice[0]!r} is there twice")


def _columns_text() -> str:
    return f"needed are {', '.join(NEEDED)}, allowed besides {' and '.join(OPTIONAL)}"


# --- The quick pass ------------------------------------------------------------------------------


def _read(path: Path, wanted: Sequence[str], names: list[_Codes]) -> tuple[Rows, IntArray]:
    """(R, 3 + clusters) first, second, outcome in half points, clusters; (R,) how often."""
    coders = [names[0], names[0], _Winners(), *names[1:]]
    parts: list[tuple[Rows, IntArray]] = [
        (np.empty((0, len(wanted)), np.int32), np.empty(0, np.int64))
    ]
    pending = 0
    with open_votes(path) as table:
        places = [table.header.index(name) for name in wanted]
        while block := list(islice(table.rows, _LINES_AT_ONCE)):
            rows = _coded(block, len(table.header), places, coders)
            parts.append((rows, np.ones(len(rows), dtype=np.int64)))
            pending += len(rows)
            if pending > _ROWS_BEFORE_GROUPING and len(wanted) == len(NEEDED):
                parts = [_grouped(parts)]
                pending = 0
    if len(wanted) == len(NEEDED):
        return _grouped(parts)
    # With judges and items hardly two votes are equal.
    rows = np.concatenate([rows for rows, _ in parts])
    return rows, np.ones(len(rows), dtype=np.int64)


def _coded(
    block: list[list[str]], width: int, places: list[int], coders: Sequence[dict[str, int]]
) -> Rows:
    """(n, columns) numbers of a block of lines; blank lines are passed over."""
    if [] in block:
        block = [row for row in block if row]
    if not block:
        return np.empty((0, len(places)), dtype=np.int32)
    if any(len(row) > width for row in block):
        block = [fit_row(row, width) for row in block]
    columns = list(zip(*block, strict=True))
    if len(columns) != width:
        raise ValueError("a line has another number of cells")
    coded = np.empty((len(block), len(places)), dtype=np.int32)
    for index, (place, codes) in enumerate(zip(places, coders, strict=True)):
        coded[:, index] = np.fromiter(
            map(codes.__getitem__, columns[place]), dtype=np.int32, count=len(block)
        )
    if (coded[:, 0] == coded[:, 1]).any():
        raise ValueError("a model is compared with itself")
    return coded


def _grouped(parts: list[tuple[Rows, IntArray]]) -> tuple[Rows, IntArray]:
    """Equal rows in one, with how often they occur."""
    rows = np.concatenate([rows for rows, _ in parts])
    counts = np.concatenate([counts for _, counts in parts])
    _, first, group = np.unique(_keys(rows), return_index=True, return_inverse=True)
    added = np.bincount(group, weights=counts, minlength=len(first))
    return rows[first], added.astype(np.int64)


def _keys(rows: Rows) -> IntArray:
    """(n,) a number for each row, equal for equal rows."""
    keys = np.zeros(len(rows), dtype=np.int64)
    largest = 1
    for column in rows.T:
        size = int(column.max(initial=0)) + 1
        if largest * size > _LARGEST_KEY:
            kinds, keys = np.unique(keys, return_inverse=True)
            largest = len(kinds)
        keys = keys * size + column
        largest *= size
    return keys


def _as_votes(
    rows: Rows, counts: IntArray, clusters: Sequence[str], names: list[_Codes]
) -> VotesFile:
    """The numbers as comparisons, names in alphabetical order so that no order of lines counts."""
    repeats = _repeats(rows, counts) if len(clusters) == len(OPTIONAL) else None
    places = [_alphabetical(codes) for codes in names]
    of_clusters = {
        name: place[rows[:, 3 + index]]
        for index, (name, place) in enumerate(zip(clusters, places[1:], strict=True))
    }
    nobody = np.zeros(len(rows), dtype=np.int64)
    votes = Comparisons(
        names=tuple(sorted(names[0].names)),
        first=places[0][rows[:, 0]],
        second=places[0][rows[:, 1]],
        score=rows[:, 2] / 2.0,
        expert=of_clusters.get("judge", nobody),
        scenario=of_clusters.get("item", nobody),
        count=counts,
    )
    return VotesFile(comparisons=votes, repeats=repeats)


def _repeats(rows: Rows, counts: IntArray) -> int:
    """Votes of a judge on an item and pair that have one already."""
    turned = rows[:, 0] > rows[:, 1]
    low, high = np.where(turned, rows[:, 1], rows[:, 0]), np.where(turned, rows[:, 0], rows[:, 1])
    keys = _keys(np.column_stack([low, high, rows[:, 3:]]))
    keys.sort()
    return int(counts.sum()) - (len(keys) - int((keys[1:] == keys[:-1]).sum()))


def _alphabetical(codes: _Codes) -> IntArray:
    """(n,) from the number of a name to its place in the alphabet."""
    order = sorted(range(len(codes.names)), key=codes.names.__getitem__)
    places = np.empty(len(order), dtype=np.int64)
    places[order] = np.arange(len(order))
    return places


# --- The slow pass -------------------------------------------------------------------------------


def _explain(path: Path, wanted: Sequence[str]) -> None:
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
