"""Formats, tables of typed columns and downloads, shared by all writers.

The same rows always give the same bytes. What is unknown or does not exist is empty.
"""

import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from typing import Any, Generic, NamedTuple, TypeVar
from uuid import UUID

from django.http import Http404, HttpResponse

from arena.exports.cells import Columns as Columns
from arena.exports.cells import Dtype as Dtype
from arena.exports.cells import Value as Value
from arena.exports.cells import csv_text

Table = TypeVar("Table")


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Generic[Table]):
    """File format of a table.

    Attributes:
        suffix: Of the file's name, without the dot.
        write: Makes the file's bytes.
    """

    suffix: str
    content_type: str
    is_text: bool
    write: Callable[[Table], bytes]


class Export(NamedTuple):
    """Something that is offered as files.

    Attributes:
        make: Makes what the formats write of a row, for example a job.
        help: A line about it.
    """

    formats: Mapping[str, Format[Any]]
    make: Callable[..., Any]
    help: str = ""


_KINDS = {
    "csv": ("csv", "text/csv; charset=utf-8", True),
    "json": ("json", "application/json", True),
    "jsonl": ("jsonl", "application/jsonl", True),
    "zip": ("zip", "application/zip", False),
    "parquet": ("parquet", "application/vnd.apache.parquet", False),
    "latex": ("tex", "application/x-tex; charset=utf-8", True),
    "svg": ("svg", "image/svg+xml", True),
    "pdf": ("pdf", "application/pdf", False),
    "png": ("png", "image/png", False),
}
"""Suffix, content type and whether it is text, by the name of the format."""


def formats(**writers: Callable[[Table], bytes]) -> dict[str, Format[Table]]:
    """Return the formats of a table by name, in the order in which they are shown."""
    made = {}
    for name, write in writers.items():
        suffix, content_type, is_text = _KINDS[name]
        made[name] = Format(suffix=suffix, content_type=content_type, is_text=is_text, write=write)
    return made


def drawings(chart: Callable[..., bytes]) -> dict[str, Format[Any]]:
    """Return the formats of a chart, which takes a table and `file_format`: svg, pdf or png."""
    return formats(**{name: partial(chart, file_format=name) for name in ("svg", "pdf", "png")})


def download(
    named: Mapping[str, Format[Table]], name: str, stem: str, table: Table
) -> HttpResponse:
    """Return a table as a file to be saved; 404 for a format that it does not have.

    Args:
        named: The formats that it has.
        name: Which of them.
        stem: The file's name without its suffix.
        table: What they write.
    """
    if name not in named:
        raise Http404
    chosen = named[name]
    return attach(chosen.write(table), chosen.content_type, f"{stem}.{chosen.suffix}")


def attach(content: bytes | str, content_type: str, name: str) -> HttpResponse:
    """Return a file to be saved under a name."""
    disposition = {"Content-Disposition": f'attachment; filename="{name}"'}
    return HttpResponse(content, content_type=content_type, headers=disposition)


# --- Tables with one line a row ----------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """Rows of named values.

    Attributes:
        name: JSON files say "scenario-arena/<name>".
        key: What the list of rows is called in JSON.
        columns: What each column holds, by its name.
        number: The format of floats in CSV.
        facts: What else a JSON file says.
    """

    name: str
    key: str = "rows"
    columns: Mapping[str, Dtype]
    rows: Sequence[Sequence[object]]
    number: str = ""
    facts: Mapping[str, object] = field(default_factory=dict)


def make_sheet(
    lines: Iterable[object], columns: Columns, *, name: str, digits: int | None = 4, **more: Any
) -> Sheet:
    """Return a row of plain values for each line.

    Args:
        lines: What the columns are read of.
        columns: How.
        name: Of the sheet.
        digits: Decimals to which floats are rounded; None for all.
        more: Further attributes of the sheet.
    """
    kinds = {column: kind for column, (_, kind) in columns.items()}
    values = [value for value, _ in columns.values()]
    rows = [tuple(read_value(line, value, digits) for value in values) for line in lines]
    return Sheet(name=name, columns=kinds, rows=rows, **more)


def read_value(line: Any, value: Value, digits: int | None = 4) -> object:
    """Return a plain value of a line; None where its path meets a None."""
    if callable(value):
        read = value(line)
    else:
        read = line
        for name in value.split("."):
            if read is not None:
                read = read[name] if isinstance(read, dict) else getattr(read, name)
    match read:
        case Enum():
            return read.value
        case float() if digits is not None:
            return round(read, digits) + 0.0
        case tuple():
            return join_numbers(read)
        case UUID():
            return str(read)
        case _:
            return read


def make_csv(columns: Mapping[str, Value], lines: Iterable[object]) -> bytes:
    """Return a CSV file with one line a row; floats have two decimals."""
    rows = ([read_value(line, value, None) for value in columns.values()] for line in lines)
    return csv_text(list(columns), rows).encode()


def join_numbers(numbers: Iterable[float], number: str = ".6g") -> str:
    """Return several numbers as one cell."""
    return " ".join(format(value, number) for value in numbers)


def json_bytes(document: object, *, sort_keys: bool = False) -> bytes:
    """Return a document as an indented JSON file."""
    text = json.dumps(document, indent=2, ensure_ascii=False, sort_keys=sort_keys)
    return (text + "\n").encode()


def sheet_csv(sheet: Sheet) -> bytes:
    """Return one line a row; no text is a formula."""
    return csv_text(tuple(sheet.columns), sheet.rows, number=sheet.number).encode()


def sheet_json(sheet: Sheet) -> bytes:
    """Return the rows as objects."""
    rows = [dict(zip(sheet.columns, row, strict=True)) for row in sheet.rows]
    head = {"format": f"scenario-arena/{sheet.name}", "version": 1}
    return json_bytes({**head, **sheet.facts, sheet.key: rows})


def sheet_jsonl(sheet: Sheet) -> bytes:
    """Return one object a line."""
    objects = (dict(zip(sheet.columns, row, strict=True)) for row in sheet.rows)
    return "".join(f"{json.dumps(one, ensure_ascii=False)}\n" for one in objects).encode()


def sheet_parquet(sheet: Sheet) -> bytes:
    """Return the rows as typed columns."""
    import pyarrow
    from pyarrow import parquet

    schema = pyarrow.schema(
        [(name, pyarrow.type_for_alias(kind)) for name, kind in sheet.columns.items()]
    )
    rows = [dict(zip(sheet.columns, row, strict=True)) for row in sheet.rows]
    file = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(rows, schema), file, compression="zstd")
    return file.getvalue()


def table_formats(make: Callable[[Table], Sheet]) -> dict[str, Format[Table]]:
    """Return the formats of what can be made a sheet."""
    return formats(
        csv=lambda table: sheet_csv(make(table)),
        json=lambda table: sheet_json(make(table)),
        parquet=lambda table: sheet_parquet(make(table)),
    )


TABLE_FORMATS: dict[str, Format[Sheet]] = table_formats(lambda sheet: sheet)
