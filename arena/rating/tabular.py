"""Tables of text from files of several kinds: CSV with any usual separator, JSON lines, Parquet.

What a file is follows from its content, not from its name.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

SEPARATORS = (",", ";", "\t", "|")
LONGEST_CELL = 2**26
_FIRST_BYTES = 65_536
_PARQUET = b"PAR1"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")

Row = list[str]


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


@contextmanager
def open_table(path: Path, wanted: Sequence[str]) -> Iterator[TextTable]:
    """Open a file; the separator is the one that finds most of the wanted columns.

    Raises:
        StopIteration: The file is empty.
        ValueError: It can't be read as what it seems to be.
        OSError: It can't be opened.
    """
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
            yield _separated(lines, _separator(beginning, wanted))


def fit_row(row: Row, width: int) -> Row:
    """The row without empty cells behind its last column."""
    while len(row) > width and not row[-1].strip():
        row = row[:-1]
    return row


# --- Private -----------------------------------------------------------------------------------


def _encoding(start: bytes) -> str:
    if start.startswith(_UTF_16):
        return "utf-16"
    if start[1:2] == b"\0":
        return "utf-16-le"
    return "utf-16-be" if start[:1] == b"\0" else "utf-8-sig"


def _separator(beginning: str, wanted: Sequence[str]) -> str:
    def found(separator: str) -> int:
        first = next(csv.reader(beginning.splitlines(keepends=True), delimiter=separator), [])
        return len({cell.strip() for cell in first} & set(wanted))

    return max(SEPARATORS, key=found)


def _separated(lines: TextIO, separator: str) -> TextTable:
    reader = csv.reader(lines, strict=True, delimiter=separator)
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
