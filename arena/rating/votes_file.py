"""Votes from a CSV file with the columns model_a, model_b, winner, and maybe judge and item.

A quick pass reads blocks of lines into numbers and only notices that something is wrong; a slow
one, line by line, then finds where and says it. Millions of lines take seconds and little memory:
no text is kept but the names.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, IntArray

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
    with _opened(path) as lines:
        header = _header(csv.reader(lines, strict=True))
    return tuple(name for name in OPTIONAL if name in header)


def read_votes(path: Path, *, clusters: Sequence[str]) -> VotesFile:
    """Read all votes.

    Args:
        path: UTF-8 with or without a mark at its start.
        clusters: Which of the optional columns to read; every line must fill them.

    Raises:
        VotesFileUnreadable: A column is missing, a winner is unknown, a cell that is needed is
            empty, a model meets itself, or a line has more or fewer cells than the first.
    """
    wanted = (*NEEDED, *clusters)
    names = [_Codes() for _ in range(1 + len(clusters))]
    try:
        rows, counts = _read(path, wanted, names)
    except (ValueError, KeyError, csv.Error) as error:
        _explain(path, wanted)
        raise VotesFileUnreadable(f"{path}: {error}") from error
    return _as_votes(rows, counts, clusters, names)


class _Codes(dict[str, int]):
    """Numbers names as they come."""

    def __missing__(self, name: str) -> int:
        number = self[name] = len(self)
        return number


def _opened(path: Path) -> TextIO:
    return path.open(encoding="utf-8-sig", newline="")


def _header(reader: Iterator[list[str]]) -> list[str]:
    try:
        header = [name.strip() for name in next(reader)]
    except StopIteration:
        raise VotesFileUnreadable(f"line 1: the file is empty; {_columns_text()}") from None
    except (csv.Error, UnicodeDecodeError) as error:
        raise VotesFileUnreadable(f"line 1: {error}; {_columns_text()}") from error
    for name in NEEDED:
        if name not in header:
            raise VotesFileUnreadable(f"line 1: there is no column {name!r}; {_columns_text()}")
    twice = [name for name in (*NEEDED, *OPTIONAL) if header.count(name) > 1]
    if twice:
        raise VotesFileUnreadable(f"line 1: the column {twice[0]!r} is there twice")
    return header


def _columns_text() -> str:
    return f"needed are {', '.join(NEEDED)}, allowed besides {' and '.join(OPTIONAL)}"


# --- The quick pass ------------------------------------------------------------------------------


def _read(path: Path, wanted: Sequence[str], names: list[_Codes]) -> tuple[Rows, IntArray]:
    """(R, 3 + clusters) first, second, outcome in half points, clusters; (R,) how often."""
    coders = [names[0], names[0], _HALF_POINTS, *names[1:]]
    parts: list[tuple[Rows, IntArray]] = [
        (np.empty((0, len(wanted)), np.int32), np.empty(0, np.int64))
    ]
    pending = 0
    with _opened(path) as lines:
        reader = csv.reader(lines, strict=True)
        header = _header(reader)
        places = [header.index(name) for name in wanted]
        while block := list(islice(reader, _LINES_AT_ONCE)):
            rows = _coded(block, len(header), places, coders)
            parts.append((rows, np.ones(len(rows), dtype=np.int64)))
            pending += len(rows)
            if pending > _ROWS_BEFORE_GROUPING and len(wanted) == len(NEEDED):
                parts = [_grouped(parts)]
                pending = 0
    if any("" in codes for codes in names):
        raise ValueError("a cell is empty")
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
        names=tuple(sorted(names[0])),
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
    places = np.empty(len(codes), dtype=np.int64)
    for place, name in enumerate(sorted(codes)):
        places[codes[name]] = place
    return places


# --- The slow pass -------------------------------------------------------------------------------


def _explain(path: Path, wanted: Sequence[str]) -> None:
    """Raise for the first line that is wrong, and say what is allowed."""
    with _opened(path) as lines:
        reader = csv.reader(lines, strict=True)
        header = _header(reader)
        places = {name: header.index(name) for name in wanted}
        before = reader.line_num
        while True:
            try:
                row = next(reader, None)
            except (csv.Error, UnicodeDecodeError) as error:
                raise VotesFileUnreadable(f"line {before + 1}: {error}") from error
            if row is None:
                return
            if row and (wrong := _wrong(row, len(header), places)):
                raise VotesFileUnreadable(f"line {before + 1}: {wrong}")
            before = reader.line_num


def _wrong(row: list[str], width: int, places: dict[str, int]) -> str:
    """What is wrong with a line, empty if nothing is."""
    if len(row) != width:
        return f"there are {len(row)} cells, in the first line {width}"
    cells = {name: row[place] for name, place in places.items()}
    empty = [name for name, cell in cells.items() if not cell]
    if empty:
        return f"{empty[0]} is empty"
    if cells["winner"] not in WINNERS:
        return f"the winner {cells['winner']!r} is none of {', '.join(WINNERS)}"
    if cells["model_a"] == cells["model_b"]:
        return f"{cells['model_a']!r} is compared with itself"
    return ""
