"""Votes from a file with the columns model_a, model_b, winner, and maybe judge and item.

The file is CSV with any usual separator, JSON lines or Parquet; what it is follows from its
content, not from its name.
"""

from __future__ import annotations

import csv
import json
import math
from array import array
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray

NEEDED = ("model_a", "model_b", "winner")
OPTIONAL = ("judge", "item")
SIDE = "side"
"""A covariate that every file has: `model_a` was on the left."""
WINNERS = {"model_a": WIN, "model_b": LOSS, "tie": TIE, "tie (bothbad)": TIE}
SEPARATORS = (",", ";", "\t", "|")
LONGEST_CELL = 2**26
_FIRST_BYTES = 65_536
_PARQUET = b"PAR1"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_LINES_TO_REPORT = 20_000

Row = list[str]


class VotesFileUnreadable(ValueError):
    """The file is not what it should be; the text has the line and what is allowed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TextTable:
    """A table while it is being read.

    Attributes:
        header: The names of the columns, without spaces around them.
        rows: Their cells, one row after the other; an empty list for a blank line.
        lines_read: How many lines of the file have been read so far; rows in Parquet, with one
            for the header.
    """

    header: Row
    rows: Iterator[Row]
    lines_read: Callable[[], int]


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
    """Return the columns that the file has beside the needed ones.

    Raises:
        VotesFileUnreadable: The first line does not name the needed columns, each once.
    """
    with open_votes(path) as table:
        return tuple(name for name in table.header if name not in NEEDED)


@contextmanager
def open_votes(path: Path) -> Iterator[TextTable]:
    """Open the table of a file that has the needed columns, each once.

    Raises:
        VotesFileUnreadable: It has not, or can't be read at all.
    """
    allowed = f"needed are {', '.join(NEEDED)}, allowed besides {' and '.join(OPTIONAL)}"
    with ExitStack() as stack:
        try:
            table = stack.enter_context(_open_table(path))
        except (StopIteration, RuntimeError):
            raise VotesFileUnreadable(f"line 1: the file is empty; {allowed}") from None
        except (csv.Error, ValueError) as error:
            raise VotesFileUnreadable(f"line 1: {error}; {allowed}") from error
        for name in NEEDED:
            if name not in table.header:
                raise VotesFileUnreadable(f"line 1: there is no column {name!r}; {allowed}")
        for name in (*NEEDED, *OPTIONAL):
            if table.header.count(name) > 1:
                raise VotesFileUnreadable(f"line 1: the column {name!r} is there twice")
        yield table


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
    models, *others = codes = [_Codes() for _ in ("model", *clusters)]
    # With judges and items hardly two votes are equal.
    is_grouped = not (clusters or covariates or in_order)
    grouped: defaultdict[tuple[int, ...], int] = defaultdict(int)
    coded, values = array("q"), array("d")
    for count, (line, cells) in enumerate(_votes_in(path, (*NEEDED, *clusters, *numbers)), 1):
        first, second, winner, *rest = cells
        row = (
            models[first],
            models[second],
            round(2 * WINNERS[winner]),
            *(of_column[cell] for of_column, cell in zip(others, rest, strict=False)),
        )
        if is_grouped:
            grouped[row] += 1
        else:
            coded.extend(row)
        named = zip(numbers, rest[len(clusters) :], strict=True)
        values.extend(_number(line, column, cell) for column, cell in named)
        if report is not None and count % _LINES_TO_REPORT == 0:
            report(count)
    width = len(NEEDED) + len(clusters)
    if is_grouped:
        coded.extend(code for row in grouped for code in row)
    rows = np.array(coded, dtype=np.int64).reshape(-1, width)
    counts = np.array(list(grouped.values()) or [1] * len(rows), dtype=np.int64)
    if report is not None:
        report(int(counts.sum()))
    return VotesFile(
        comparisons=_as_votes(
            rows, counts, clusters, codes, _columns(covariates, values, len(rows))
        ),
        repeats=_repeats(rows) if len(clusters) == len(OPTIONAL) else None,
    )


def is_missing(name: str) -> bool:
    """Return whether a cell says nothing: empty, or what other programs write for that."""
    return not name or name.lower() == "nan"


# --- Lines ---------------------------------------------------------------------------------------


def _votes_in(path: Path, wanted: Sequence[str]) -> Iterator[tuple[int, Row]]:
    """Yield the number and the wanted cells of each line that is not blank."""
    with open_votes(path) as table:
        places = [table.header.index(name) for name in wanted]
        width = len(table.header)
        before = table.lines_read()
        while True:
            try:
                row = next(table.rows, None)
            except (csv.Error, ValueError) as error:
                raise VotesFileUnreadable(f"line {before + 1}: {error}") from error
            if row is None:
                return
            if row:
                while len(row) > width and not row[-1].strip():
                    row = row[:-1]
                cells = [row[place].strip() for place in places] if len(row) == width else []
                if wrong := _wrong(len(row), width, dict(zip(wanted, cells, strict=False))):
                    raise VotesFileUnreadable(f"line {before + 1}: {wrong}")
                yield before + 1, cells
            before = table.lines_read()


def _wrong(cells_there: int, width: int, cells: dict[str, str]) -> str:
    """Return what is wrong with a line, empty if nothing is."""
    if cells_there != width:
        return f"there are {cells_there} cells, in the first line {width}"
    for name, cell in cells.items():
        if is_missing(cell):
            return f"{name} is {cell!r}, which is no name" if cell else f"{name} is empty"
    if cells["winner"] not in WINNERS:
        return f"the winner {cells['winner']!r} is none of {', '.join(WINNERS)}"
    if cells["model_a"] == cells["model_b"]:
        return f"{cells['model_a']!r} is compared with itself"
    return ""


def _number(line: int, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise VotesFileUnreadable(f"line {line}: {column} is {cell!r}, which is no number")
    return value


class _Codes(dict[str, int]):
    """Numbers names as they come."""

    def __missing__(self, name: str) -> int:
        self[name] = len(self)
        return self[name]

    def alphabetical(self) -> IntArray:
        """(n,) from the number of a name to its place in the alphabet."""
        places = np.empty(len(self), dtype=np.int64)
        places[[self[name] for name in sorted(self)]] = np.arange(len(self))
        return places


def _as_votes(
    rows: IntArray,
    counts: IntArray,
    clusters: Sequence[str],
    codes: Sequence[_Codes],
    columns: Sequence[FloatArray],
) -> Comparisons:
    """Return the numbers as comparisons, names in alphabetical order: no order of lines counts."""
    models, *others = (of_column.alphabetical() for of_column in codes)
    of_clusters = {
        name: place[rows[:, len(NEEDED) + index]]
        for index, (name, place) in enumerate(zip(clusters, others, strict=True))
    }
    nobody = np.zeros(len(rows), dtype=np.int64)
    return Comparisons(
        names=tuple(sorted(codes[0])),
        first=models[rows[:, 0]],
        second=models[rows[:, 1]],
        score=rows[:, 2] / 2.0,
        expert=of_clusters.get("judge", nobody),
        scenario=of_clusters.get("item", nobody),
        count=counts,
        covariates=np.column_stack(columns) if columns else np.empty((len(rows), 0)),
    )


def _columns(covariates: Sequence[str], values: array[float], rows: int) -> list[FloatArray]:
    """(R,) of each covariate, from both ends' numbers of each row, one row after the other."""
    pairs = sum(name != SIDE for name in covariates)
    both = np.array(values, dtype=np.float64).reshape(rows, pairs, 2)
    differences = iter((both[:, :, 0] - both[:, :, 1]).T)
    return [np.ones(rows) if name == SIDE else next(differences) for name in covariates]


def _repeats(rows: IntArray) -> int:
    """Count votes of a judge on an item and pair that have one already."""
    keys = np.column_stack([np.sort(rows[:, :2], axis=1), rows[:, len(NEEDED) :]])
    return len(keys) - len(np.unique(keys, axis=0))


# --- Kinds of files ------------------------------------------------------------------------------


@contextmanager
def _open_table(path: Path) -> Iterator[TextTable]:
    """Open a file by what its first bytes say that it is."""
    with path.open("rb") as file:
        start = file.read(_FIRST_BYTES)
    if start.startswith(_PARQUET):
        yield _parquet(path)
        return
    csv.field_size_limit(LONGEST_CELL)
    with path.open(encoding=_encoding(start), newline="") as lines:
        beginning = lines.read(_FIRST_BYTES)
        lines.seek(0)
        if beginning.lstrip().startswith("{"):
            yield _json_lines(lines)
        else:
            yield _separated(lines, beginning)


def _encoding(start: bytes) -> str:
    if start.startswith(_UTF_16):
        return "utf-16"
    if start[1:2] == b"\0":
        return "utf-16-le"
    return "utf-16-be" if start[:1] == b"\0" else "utf-8-sig"


def _separated(lines: TextIO, beginning: str) -> TextTable:
    """A row a line; the separator is the one that finds most of the known columns."""

    def count_known(separator: str) -> int:
        first = next(csv.reader(beginning.splitlines(keepends=True), delimiter=separator), [])
        return len({cell.strip() for cell in first} & {*NEEDED, *OPTIONAL})

    reader = csv.reader(lines, strict=True, delimiter=max(SEPARATORS, key=count_known))
    header = [name.strip() for name in next(reader)]
    while header and not header[-1]:
        header.pop()
    return TextTable(header=header, rows=reader, lines_read=lambda: reader.line_num)


def _json_lines(lines: TextIO) -> TextTable:
    """An object a line; the columns are those of the first."""
    count = 0
    first = _object(next(line for line in lines if line.strip()))
    header = list(first)
    lines.seek(0)

    def rows() -> Iterator[Row]:
        nonlocal count
        for line in lines:
            if line.strip():
                found = _object(line)
                row = [_text(found.get(name)) for name in header]
            else:
                row = []
            count += 1
            yield row

    return TextTable(header=header, rows=rows(), lines_read=lambda: count)


def _object(line: str) -> dict[str, object]:
    try:
        found = json.loads(line)
    except json.JSONDecodeError as error:
        raise ValueError(f"no JSON object: {error}") from error
    if not isinstance(found, dict):
        raise ValueError("no JSON object")
    return found


def _parquet(path: Path) -> TextTable:
    from pyarrow import ArrowException, parquet

    try:
        file = parquet.ParquetFile(path)
    except ArrowException as error:
        raise ValueError(f"no readable Parquet: {error}") from error
    header = list(file.schema_arrow.names)
    count = 1

    def rows() -> Iterator[Row]:
        nonlocal count
        for batch in file.iter_batches():
            for cells in zip(*(column.to_pylist() for column in batch.columns), strict=True):
                row = [_text(cell) for cell in cells]
                count += 1
                yield row

    return TextTable(header=header, rows=rows(), lines_read=lambda: count)


def _text(cell: object) -> str:
    """As our CSV files have it."""
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    return "" if cell is None else str(cell)
