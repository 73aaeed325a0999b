"""Columns out of Arrow and Parquet files that somebody else made.

Both formats can be compressed a thousandfold, and pyarrow takes every length in a file at its
word: what is too large for the memory of the reading process ends there (`sandbox`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument


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

    block, wanted = _bytes(file, what), (*whole, *numbers, *texts)
    try:
        with pa.ipc.open_file(pa.py_buffer(block)) as reader:
            _check_names(file, what, reader.schema.names, wanted)
            table = reader.read_all().select(list(wanted))
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
        with parquet.ParquetFile(pa.BufferReader(block), read_dictionary=list(texts)) as opened:
            _check_names(file, what, opened.schema_arrow.names, wanted)
            table = opened.read(columns=list(wanted), use_threads=False)
        table.validate(full=True)
    except _faults() as fault:
        text = f"is not a parquet file: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    return _columns(table, file, what, numbers, texts, whole)


# Private


def _faults() -> tuple[type[BaseException], ...]:
    """All that a broken file makes of pyarrow; want of memory is `sandbox`'s to say."""
    import pyarrow as pa

    usual = (ValueError, TypeError, KeyError, IndexError, OSError, OverflowError)
    return (*usual, NotImplementedError, pa.ArrowCapacityError, pa.ArrowSerializationError)


def _bytes(file: Path, what: str) -> bytes:
    if not file.is_file():
        raise InvalidDocument(what, [(file.name, f"is not in {file.parent}")])
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

    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    array = column.unify_dictionaries().combine_chunks()
    if isinstance(array, pa.ChunkedArray):
        array = (
            array.chunk(0) if array.num_chunks else pa.array([], pa.string()).dictionary_encode()
        )
    if array.null_count or array.dictionary.null_count:
        raise ValueError("a text is missing")
    given = [str(one) for one in array.dictionary.to_pylist()]
    values = tuple(sorted(set(given)))
    place = {text: number for number, text in enumerate(values)}
    ranks = np.array([place[text] for text in given], dtype=np.int64)
    codes = array.indices.to_numpy(zero_copy_only=False).astype(np.int64)
    return TextColumn(values=values, codes=ranks[codes] if len(codes) else codes)
