"""What all writers share: the formats that there are, Parquet files, and rounded numbers."""

import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, Protocol, TypeVar

from django.http import Http404, HttpResponse

from augment.errors import UnknownName

Table = TypeVar("Table")
Named = TypeVar("Named")
Drawn = TypeVar("Drawn", contravariant=True)

TEXT, WHOLE, NUMBER, YES_NO = "string", "int64", "double", "bool"
"""What a column of a Parquet file can hold; every cell may be empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Generic[Table]):
    """How a table can be written.

    Attributes:
        suffix: Of the file's name, without the dot.
        write: Makes the file's bytes.
    """

    suffix: str
    content_type: str
    is_text: bool
    write: Callable[[Table], bytes]


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
    """How a table can be written: a writer for each name, in the order in which they are shown."""
    made = {}
    for name, write in writers.items():
        suffix, content_type, is_text = _KINDS[name]
        made[name] = Format(suffix=suffix, content_type=content_type, is_text=is_text, write=write)
    return made


def format_named(known: Mapping[str, Named], name: str) -> Named:
    """How to write that format.

    Raises:
        UnknownName: It is none of the known ones.
    """
    if name not in known:
        raise UnknownName("format", name, list(known))
    return known[name]


class _Drawing(Protocol[Drawn]):
    """A chart as a file of that format: svg, pdf or png."""

    def __call__(self, table: Drawn, /, *, file_format: str) -> bytes: ...


def drawings(chart: _Drawing[Table]) -> dict[str, Callable[[Table], bytes]]:
    """The writers of a chart."""
    return {name: partial(chart, file_format=name) for name in ("svg", "pdf", "png")}


def parquet_bytes(columns: Mapping[str, str], rows: Iterable[Sequence[object]]) -> bytes:
    """A Parquet file; the same rows always give the same bytes.

    Args:
        columns: What each holds, by its name.
        rows: Their cells, in the order of the columns; None is unknown.
    """
    import pyarrow
    from pyarrow import parquet

    kinds = [pyarrow.type_for_alias(kind) for kind in columns.values()]
    cells = list(zip(*rows, strict=True)) or [() for _ in columns]
    arrays = [
        pyarrow.array(list(column), type=kind) for column, kind in zip(cells, kinds, strict=True)
    ]
    file = io.BytesIO()
    parquet.write_table(pyarrow.table(arrays, names=list(columns)), file, compression="zstd")
    return file.getvalue()


def round_value(value: float | None) -> float | None:
    """Four decimals, which every machine agrees on."""
    return None if value is None else round(value, 4)


def download(
    known: Mapping[str, Format[Table]], name: str, stem: str, make: Callable[[], Table]
) -> HttpResponse:
    """Return a table as a file to be saved.

    Args:
        known: The formats that it has.
        name: Which of them; 404 for another.
        stem: The file's name without its suffix.
        make: Makes the table.
    """
    if name not in known:
        raise Http404
    return HttpResponse(
        known[name].write(make()),
        content_type=known[name].content_type,
        headers={"Content-Disposition": f'attachment; filename="{stem}.{known[name].suffix}"'},
    )
