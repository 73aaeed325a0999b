"""Columns out of Arrow and Parquet files that somebody else made.

Both formats can be compressed a thousandfold, and their readers take every length in a file at
its word. So all lengths are looked at before anything is unpacked: of Arrow the message headers
(flatbuffers), of Parquet the page headers (Thrift's compact protocol).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.thrift import Truncated, read_struct

MOST_FILE_BYTES = 128 * 1024 * 1024
MOST_BYTES = 128 * 1024 * 1024
"""Of all that is unpacked."""
MOST_ROWS = 500_000
LONGEST_TEXT = 200
MOST_TEXTS = 50_000
"""Different ones in a column."""

_ARROW, _HEAD_BYTES = b"ARROW1", 8
_DICTIONARY_BATCH, _RECORD_BATCH = 2, 3
_GROWING_ENCODING = 7
"""Parquet's DELTA_BYTE_ARRAY: a few bytes repeat all of the text before."""


@dataclass(frozen=True, slots=True, eq=False)
class TextColumn:
    """A column of texts.

    Attributes:
        values: The different ones, ascending.
        codes: For each row the place of its text among them.
    """

    values: tuple[str, ...]
    codes: NDArray[np.int64]


Columns = dict[str, Any]
"""By name: a `TextColumn`, or numbers as float64 or int64."""


def read_arrow(
    file: Path, *, what: str, numbers: Sequence[str], texts: Sequence[str], whole: Sequence[str]
) -> Columns:
    """The named columns of an Arrow file (Feather, version 2), all present and finite.

    Args:
        file: The file.
        what: How faults call the source.
        numbers: Columns of finite numbers.
        texts: Columns of texts.
        whole: Columns of whole numbers.

    Raises:
        InvalidDocument: The file, a column or a value is not so.
    """
    import pyarrow as pa

    block = _bytes(file, what)
    if block[:6] != _ARROW:
        raise InvalidDocument(what, [(file.name, "is not a feather file of version 2")])
    try:
        stream = pa.py_buffer(block).slice(_HEAD_BYTES)
        _check_messages(pa.ipc.MessageReader.open_stream(stream))
        with pa.ipc.open_stream(stream) as reader:
            _check_names(file, what, reader.schema.names, (*whole, *numbers, *texts))
            table = reader.read_all().select([*whole, *numbers, *texts])
        table.validate(full=True)
    except _faults() as fault:
        text = f"is not a feather file: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    return _columns(table, file, what, numbers, texts, whole)


def read_parquet(
    file: Path, *, what: str, numbers: Sequence[str], texts: Sequence[str], whole: Sequence[str]
) -> Columns:
    """The same of a Parquet file.

    Raises:
        InvalidDocument: As above.
    """
    import pyarrow as pa
    from pyarrow import parquet

    block, wanted = _bytes(file, what), (*whole, *numbers, *texts)
    try:
        with parquet.ParquetFile(
            pa.BufferReader(block),
            read_dictionary=list(texts),
            thrift_string_size_limit=1_000_000,
            thrift_container_size_limit=100_000,
        ) as opened:
            _check_names(file, what, opened.schema_arrow.names, wanted)
            _check_pages(opened.metadata, block, wanted)
            table = opened.read(columns=list(wanted), use_threads=False)
        table.validate(full=True)
    except _faults() as fault:
        text = f"is not a parquet file: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    return _columns(table, file, what, numbers, texts, whole)


# Private


def _faults() -> tuple[type[BaseException], ...]:
    """All that a broken file makes of pyarrow, and of our own looking."""
    import pyarrow as pa

    ours = (Truncated, ValueError, TypeError, KeyError, IndexError, struct.error)
    return (*ours, pa.ArrowException, OSError, MemoryError, OverflowError, NotImplementedError)


def _bytes(file: Path, what: str) -> bytes:
    if not file.is_file():
        raise InvalidDocument(what, [(file.name, f"is not in {file.parent}")])
    if file.stat().st_size > MOST_FILE_BYTES:
        raise InvalidDocument(what, [(file.name, f"is larger than {MOST_FILE_BYTES} bytes")])
    return file.read_bytes()


def _check_names(file: Path, what: str, there: Sequence[str], wanted: Sequence[str]) -> None:
    missing = [name for name in wanted if list(there).count(name) != 1]
    if missing:
        raise InvalidDocument(what, [(file.name, f"has no column {name!r}") for name in missing])


def _columns(
    table: Any,
    file: Path,
    what: str,
    numbers: Sequence[str],
    texts: Sequence[str],
    whole: Sequence[str],
) -> Columns:
    try:
        columns: Columns = {name: _text_column(table[name]) for name in texts}
        columns |= {name: table[name].to_numpy().astype(np.float64) for name in numbers}
        columns |= {
            name: table[name].to_numpy().astype(np.int64, casting="safe") for name in whole
        }
    except _faults() as fault:
        text = f"has a column of a wrong kind: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    for name in numbers:
        broken = np.flatnonzero(~np.isfinite(columns[name]))
        if len(broken):
            raise InvalidDocument(what, [(f"{file.name}[{broken[0]}].{name}", "is not finite")])
    return columns


def _text_column(column: Any) -> TextColumn:
    """Each text once: a thousand rows may share one of a megabyte."""
    import pyarrow as pa
    from pyarrow import compute

    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    array = column.unify_dictionaries().combine_chunks()
    if isinstance(array, pa.ChunkedArray):
        array = (
            array.chunk(0) if array.num_chunks else pa.array([], pa.string()).dictionary_encode()
        )
    if array.null_count or array.dictionary.null_count:
        raise ValueError("a text is missing")
    if len(array.dictionary) > MOST_TEXTS:
        raise ValueError(f"more than {MOST_TEXTS} different texts")
    lengths = compute.binary_length(array.dictionary)
    if len(lengths) and (compute.max(lengths).as_py() or 0) > 4 * LONGEST_TEXT:
        raise ValueError(f"a text is longer than {LONGEST_TEXT} characters")
    given = [str(one) for one in array.dictionary.to_pylist()]
    values = tuple(sorted(set(given)))
    place = {text: number for number, text in enumerate(values)}
    ranks = np.array([place[text] for text in given], dtype=np.int64)
    codes = array.indices.to_numpy(zero_copy_only=False).astype(np.int64)
    return TextColumn(values=values, codes=ranks[codes] if len(codes) else codes)


# Private: Arrow's message headers


def _check_messages(messages: Any) -> None:
    total = rows = 0
    for message in messages:
        header = message.metadata.to_pybytes()
        table = _followed(header, 0)
        kind = header[_field(header, table, 1) or 0] if _field(header, table, 1) else 0
        place = _field(header, table, 2)
        if kind not in (_DICTIONARY_BATCH, _RECORD_BATCH) or place is None:
            continue
        batch = _followed(header, place)
        if kind == _DICTIONARY_BATCH:
            place = _field(header, batch, 1)
            if place is None:
                continue
            batch = _followed(header, place)
        rows += _rows_of(header, batch)
        if rows > MOST_ROWS:
            raise ValueError(f"more than {MOST_ROWS} rows")
        total += sum(_unpacked(header, batch, message.body))
        if total > MOST_BYTES:
            raise ValueError(f"unpacks to more than {MOST_BYTES} bytes")


def _rows_of(header: bytes, batch: int) -> int:
    """How many rows a batch, or the longest of its columns, claims to have."""
    rows = _field(header, batch, 0)
    counts = [0] if rows is None else [struct.unpack_from("<q", header, rows)[0]]
    counts += [length for length, _ in _pairs(header, _field(header, batch, 1))]
    if min(counts) < 0:
        raise ValueError("a negative number of rows")
    return int(max(counts))


def _unpacked(header: bytes, batch: int, body: Any) -> Iterator[int]:
    """How many bytes each buffer of a batch claims to be."""
    is_packed = _field(header, batch, 3) is not None
    for offset, length in _pairs(header, _field(header, batch, 2)):
        if not is_packed or length < 8:
            yield max(length, 0)
            continue
        if body is None or not 0 <= offset <= body.size - 8:
            raise ValueError("a buffer lies outside of its message")
        (claimed,) = struct.unpack("<q", body.slice(offset, 8).to_pybytes())
        yield length if claimed < 0 else claimed


def _followed(header: bytes, place: int) -> int:
    return place + int(struct.unpack_from("<I", header, place)[0])


def _field(header: bytes, table: int, number: int) -> int | None:
    """Where a field of a flatbuffer's table lies; None where it is left out."""
    names = table - int(struct.unpack_from("<i", header, table)[0])
    (size,) = struct.unpack_from("<H", header, names)
    if 4 + 2 * number >= size:
        return None
    (offset,) = struct.unpack_from("<H", header, names + 4 + 2 * number)
    return table + offset if offset else None


def _pairs(header: bytes, place: int | None) -> Iterator[tuple[int, int]]:
    """A vector of structs of two 64-bit numbers."""
    if place is None:
        return
    start = _followed(header, place)
    (count,) = struct.unpack_from("<I", header, start)
    for number in range(min(count, len(header) // 16)):
        yield struct.unpack_from("<qq", header, start + 4 + 16 * number)


# Private: Parquet's page headers


def _check_pages(metadata: Any, block: bytes, wanted: Sequence[str]) -> None:
    if metadata.num_rows > MOST_ROWS:
        raise ValueError(f"more than {MOST_ROWS} rows")
    total = 0
    for group in map(metadata.row_group, range(metadata.num_row_groups)):
        for column in map(group.column, range(group.num_columns)):
            if column.path_in_schema not in wanted:
                continue
            if column.num_values > MOST_ROWS:
                raise ValueError(f"more than {MOST_ROWS} rows")
            for size in _page_sizes(column, block):
                total += size
                if total > MOST_BYTES:
                    raise ValueError(f"unpacks to more than {MOST_BYTES} bytes")


def _page_sizes(column: Any, block: bytes) -> Iterator[int]:
    first = column.dictionary_page_offset or column.data_page_offset
    place = min(first, column.data_page_offset)
    end = place + column.total_compressed_size
    if not 0 <= place <= end <= len(block):
        raise ValueError("a column lies outside of the file")
    while place < end:
        header, after = read_struct(block, place)
        unpacked, packed = header.get(2), header.get(3)
        data = header.get(5) or header.get(8) or {}
        if not isinstance(unpacked, int) or not isinstance(packed, int) or packed < 0:
            raise ValueError("a page has no size")
        if isinstance(data, dict) and _GROWING_ENCODING in (data.get(2), data.get(4)):
            raise ValueError("texts that are told by their difference are not read")
        yield max(unpacked, 0)
        place = after + packed
