"""Votes from a file with the columns model_a, model_b, winner, and maybe judge and item.

A quick pass reads blocks of lines into numbers and only notices that something is wrong; a slow
one, line by line (`arena.rating.votes_table`), then finds where and says it. Millions of lines
take seconds and little memory: no text is kept but the names.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import Comparisons, IntArray
from arena.rating.tabular import fit_row
from arena.rating.votes_table import (
    NEEDED,
    OPTIONAL,
    SIDE,
    WINNERS,
    VotesFileUnreadable,
    explain,
    is_missing,
    line_of,
    open_votes,
)

_LINES_AT_ONCE = 20_000
_ROWS_BEFORE_GROUPING = 500_000
_LARGEST_KEY = 2**62

Rows = NDArray[np.int32]
_HALF_POINTS = {winner: round(2 * score) for winner, score in WINNERS.items()}


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


def read_votes(
    path: Path,
    *,
    clusters: Sequence[str],
    covariates: Sequence[str] = (),
    in_order: bool = False,
    report: Callable[[int], None] | None = None,
) -> VotesFile:
    """Read all votes.

    Args:
        path: CSV, JSON lines or Parquet; text in UTF-8 or UTF-16.
        clusters: Which of the optional columns to read; every line must fill them.
        covariates: What else may say who wins: `side`, or a name NAME with columns NAME_a and
            NAME_b of numbers, of which the difference counts.
        in_order: Keep a row for each line, in the order of the lines.
        report: Is told how many votes are read.

    Raises:
        VotesFileUnreadable: A column is missing, a winner is unknown, a cell that is needed is
            empty or no number, a model meets itself, or a line has more or fewer cells than the
            first.
    """
    numbers = [f"{name}_{end}" for name in covariates if name != SIDE for end in "ab"]
    wanted = (*NEEDED, *clusters, *numbers)
    names = [_Codes() for _ in wanted[2:]]
    try:
        rows, counts = _read(path, wanted, names, report, in_order=in_order)
    except VotesFileUnreadable:
        raise
    except (ValueError, KeyError, csv.Error) as error:
        explain(path, wanted)
        raise VotesFileUnreadable(f"{path.name}: {error}") from error
    many = 1 + len(clusters)
    found = _as_votes(rows[:, : 2 + many], counts, clusters, names[:many])
    if covariates:
        first = 3 + len(clusters)
        values = {
            name: _numbers(path, name, codes)[rows[:, place]]
            for place, (name, codes) in enumerate(
                zip(numbers, names[1 + len(clusters) :], strict=False), start=first
            )
        }
        columns = [
            np.ones(len(rows)) if name == SIDE else values[f"{name}_a"] - values[f"{name}_b"]
            for name in covariates
        ]
        votes = replace(found.comparisons, covariates=np.column_stack(columns))
        found = replace(found, comparisons=votes)
    return found


def _numbers(path: Path, column: str, codes: _Codes) -> NDArray[np.float64]:
    """(n,) what the names of a column are as numbers."""
    values = np.empty(len(codes.names))
    for place, name in enumerate(codes.names):
        try:
            values[place] = float(name)
        except ValueError:
            values[place] = math.nan
        if not math.isfinite(values[place]):
            raise VotesFileUnreadable(
                f"line {line_of(path, column, name)}: {column} is {name!r}, which is no number"
            )
    return values


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


# --- The quick pass ------------------------------------------------------------------------------


def _read(
    path: Path,
    wanted: Sequence[str],
    names: list[_Codes],
    report: Callable[[int], None] | None,
    *,
    in_order: bool,
) -> tuple[Rows, IntArray]:
    """(R, 3 + clusters) first, second, outcome in half points, clusters; (R,) how often."""
    coders = [names[0], names[0], _Winners(), *names[1:]]
    parts: list[tuple[Rows, IntArray]] = [
        (np.empty((0, len(wanted)), np.int32), np.empty(0, np.int64))
    ]
    pending = total = 0
    # With judges and items hardly two votes are equal.
    is_grouped = len(wanted) == len(NEEDED) and not in_order
    with open_votes(path) as table:
        places = [table.header.index(name) for name in wanted]
        while block := list(islice(table.rows, _LINES_AT_ONCE)):
            rows = _coded(block, len(table.header), places, coders)
            parts.append((rows, np.ones(len(rows), dtype=np.int64)))
            pending += len(rows)
            total += len(rows)
            if report is not None:
                report(total)
            if pending > _ROWS_BEFORE_GROUPING and is_grouped:
                parts = [_grouped(parts)]
                pending = 0
    if is_grouped:
        return _grouped(parts)
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
