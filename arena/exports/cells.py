"""Values of a CSV file and types of a table's columns; no Django."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any

AT_ONCE = 1000
"""So many lines of a streamed file are written together."""

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


class Dtype(StrEnum):
    """Type of a Parquet column; every cell may be empty."""

    TEXT = "string"
    WHOLE = "int64"
    NUMBER = "double"
    YES_NO = "bool"

    def columns(self, *names: str, of: str = "") -> "Columns":
        """Return columns of this type, called like the attributes that they show.

        Args:
            names: Of columns and attributes.
            of: The path to what has them, if that is not the line itself.
        """
        return {name: (f"{of}.{name}" if of else name, self) for name in names}


Value = str | Callable[[Any], object]
"""A dotted path of attributes or keys, or a function of a line."""
Columns = Mapping[str, tuple[Value, Dtype]]
"""By name: the value, and what the column holds."""


def cell(value: object, number: str = ".2f") -> str:
    """Return a cell that no spreadsheet takes for a formula; `number` is the format of floats."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return format(value, number)
    text = str(value)
    guard = "'" if text.startswith(_FORMULA) else ""
    return guard + text.replace("\r", " ").replace("\n", " ")


def csv_text(head: Sequence[str], rows: Iterable[Sequence[object]], *, number: str = ".2f") -> str:
    """A CSV file; no cell below its head is a formula."""
    return b"".join(csv_parts(head, rows, number=number)).decode()


def csv_parts(
    head: Sequence[str], rows: Iterable[Sequence[object]], *, number: str = ".2f"
) -> Iterator[bytes]:
    """The same file, AT_ONCE lines at a time while the rest is read."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(head)
    for written, row in enumerate(rows, start=1):
        writer.writerow([cell(value, number) for value in row])
        if written % AT_ONCE == 0:
            yield _take_written(sheet)
    yield _take_written(sheet)


def _take_written(sheet: io.StringIO) -> bytes:
    """Return the bytes written since the last call."""
    content = sheet.getvalue().encode()
    sheet.seek(0)
    sheet.truncate()
    return content


SIMULATED = " (simulated)"


def show_name(who: Any) -> str:
    """Return the name of a contestant or a line, with "(simulated)" where that is so."""
    return f"{who.name}{SIMULATED if who.is_simulated else ''}"
