"""Tables as Parquet files; the same rows always give the same bytes."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence

TEXT, WHOLE, NUMBER, YES_NO = "text", "whole", "number", "yes or no"
"""What a column can hold; every cell may be empty."""


def parquet_bytes(columns: Mapping[str, str], rows: Iterable[Sequence[object]]) -> bytes:
    """One file.

    Args:
        columns: What each holds, by its name.
        rows: Their cells, in the order of the columns; None is unknown.
    """
    import pyarrow
    from pyarrow import parquet

    kinds = {
        TEXT: pyarrow.string(),
        WHOLE: pyarrow.int64(),
        NUMBER: pyarrow.float64(),
        YES_NO: pyarrow.bool_(),
    }
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in columns.items()])
    cells = list(zip(*rows, strict=True)) or [() for _ in columns]
    table = pyarrow.table(
        [
            pyarrow.array(list(column), type=kinds[kind])
            for column, kind in zip(cells, columns.values(), strict=True)
        ],
        schema=schema,
    )
    file = io.BytesIO()
    parquet.write_table(table, file, compression="zstd")
    return file.getvalue()
