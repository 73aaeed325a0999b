"""How values stand in a CSV file."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence

AT_ONCE = 1000
"""So many lines of a streamed file are written together."""

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


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
            yield _taken(sheet)
    yield _taken(sheet)


def _taken(sheet: io.StringIO) -> bytes:
    """What was written since the last time."""
    content = sheet.getvalue().encode()
    sheet.seek(0)
    sheet.truncate()
    return content
