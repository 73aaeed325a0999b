"""Numbers and names out of a stranger's recording, checked where they come in.

What breaks the format is told as one place in the file and what is allowed there.
"""

from collections.abc import Mapping
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument

FloatArray = NDArray[np.float64]
Key = TypeVar("Key")
Value = TypeVar("Value")

WHAT: Final = "recording"
FURTHEST: Final = 1e8
"""Nothing on earth is further from the origin of a map, in metres."""

_MOST_LISTED = 40


def fault_at(place: str, text: str) -> InvalidDocument:
    """Return the error of what is wrong in a recording, and where."""
    return InvalidDocument(WHAT, [(place, text)])


def look_up(table: Mapping[Key, Value], key: object, place: str) -> Value:
    """Return what a name of the format means.

    Raises:
        InvalidDocument: The table does not have it.
    """
    try:
        return table[key]  # type: ignore[index]
    except (KeyError, TypeError):
        known = ", ".join(map(str, [*table][:_MOST_LISTED]))
        raise fault_at(place, f"unknown {str(key)[:40]!r}; known: {known}") from None


def read_numbers(rows: Any, place: str, columns: int | None = None) -> FloatArray:
    """Return rows of numbers as (R, C).

    Args:
        rows: Nested sequences, a table or an array; a single dimension becomes one column.
        place: Where they stand.
        columns: How many each row needs at least; further ones are left. None for all.

    Raises:
        InvalidDocument: One is no number, or a row has fewer.
    """
    try:
        array = np.array(rows)
        if array.dtype.kind not in "iufb":
            array = np.array(rows, dtype=object).astype(np.float64)
        array = array.astype(np.float64).reshape(len(array), -1)
    except (TypeError, ValueError, OverflowError):
        raise fault_at(place, "needs an array of numbers") from None
    if columns is not None and len(array) and array.shape[1] < columns:
        raise fault_at(place, f"needs {columns} numbers a row")
    return array[:, :columns] if len(array) else np.empty((0, columns or 0))


def read_finite(rows: Any, place: str, columns: int | None = None) -> FloatArray:
    """Return rows of finite numbers; as `read_numbers`."""
    array = read_numbers(rows, place, columns)
    beyond = ~(np.abs(array) <= FURTHEST)
    if beyond.any():
        row = int(beyond.any(axis=1).argmax())
        raise fault_at(f"{place}[{row}]", f"needs finite numbers up to {FURTHEST:.0e}")
    return array


def read_times(values: Any, place: str) -> FloatArray:
    """Return times in seconds since the first of them, (T,).

    Raises:
        InvalidDocument: There is none, or they do not ascend.
    """
    times_s = read_numbers(values, place).reshape(-1)
    if not len(times_s) or not np.isfinite(times_s).all() or (np.diff(times_s) <= 0.0).any():
        raise fault_at(place, "needs finite times that ascend")
    return np.asarray(times_s - times_s[0])
