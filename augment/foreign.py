"""One vocabulary for values from elsewhere: absent, understood, or not understood.

A border (the wire, a reader of files) takes each value of a foreign document through here. What is
not understood is a fault, told as its place in the document and what is allowed there; where it
costs a part alone, `Doubts` makes a note of it, so that no default takes its place unseen. Pure.
"""

import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any, Final, SupportsInt, TypeVar

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
_KINDS = {bool: "a boolean", int: "a number", float: "a number", str: "a text", list: "a list"}


def describe_kind(value: object) -> str:
    """Return a JSON value's kind in words."""
    return _KINDS.get(type(value), "an object")


def fault_at(place: str, text: str) -> InvalidDocument:
    """Return the error of what is wrong in a recording, and where."""
    return InvalidDocument(WHAT, [(place, text)])


def name_all(meanings: Mapping[Value, str]) -> dict[str, Value]:
    """Return the meaning of each name of a format, from the names of each meaning."""
    return {name: meaning for meaning, names in meanings.items() for name in names.split()}


def look_up(table: Mapping[Key, Value], key: object, place: str) -> Value:
    """Return the meaning of a name of the format.

    Raises:
        InvalidDocument: The table does not have it.
    """
    try:
        return table[key]  # type: ignore[index]
    except (KeyError, TypeError):
        choices = ", ".join(map(str, [*table][:_MOST_LISTED]))
        raise fault_at(place, f"unknown {str(key)[:40]!r}; known: {choices}") from None


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
        if array.dtype.kind == "U" and np.char.count(array, "_").any():
            raise ValueError
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


# What stands for one value: absent (the caller's None), understood, or not understood (a fault)

_KMH, _MPH = 1.0 / 3.6, 0.44704
_UNITS_MPS = {
    **{"km/h": _KMH, "kmh": _KMH, "kph": _KMH, "kmph": _KMH, "mph": _MPH, "mi/h": _MPH},
    **{"m/s": 1.0, "mps": 1.0},
}
_SPEED = re.compile(r"\s*([0-9]+(?:[.,][0-9]*)?(?:e[+-]?[0-9]+)?)\s*([a-z/]*)\s*", re.IGNORECASE)
FASTEST_MPS: Final = 100.0


def read_number(
    value: object, place: str, least: float = -FURTHEST, most: float = FURTHEST
) -> float:
    """Return a finite number within bounds, also from its text or from a list of it alone.

    Raises:
        InvalidDocument: It is none.
    """
    value = value.ravel().tolist() if isinstance(value, np.ndarray) else value
    value = value[0] if isinstance(value, list) and len(value) == 1 else value
    number = math.nan
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        with suppress(ValueError, OverflowError):
            number = math.nan if "_" in str(value) else float(value)  # 1_000 is Python's own
    if not least <= number <= most:
        reach = f"from {least:g} to {most:g}"
        raise fault_at(place, f"expected a finite number {reach}, got {str(value)[:40]!r}")
    return number


def read_whole(value: object, place: str, least: float = -math.inf, most: float = math.inf) -> int:
    """Return a whole number such as an id or a count, also from 12.0 or its text.

    Raises:
        InvalidDocument: It is none, or out of bounds.
    """
    text = str(value).strip().removesuffix(".0") if isinstance(value, str | float) else ""
    if len(text) <= 18 and text.removeprefix("-").isdecimal():
        value = int(text)
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        reach = "" if most == math.inf else f" from {least:g} to {most:g}"
        raise fault_at(place, f"expected a whole number{reach}, got {str(value)[:40]!r}")
    return value


def read_as(value: object, kind: type[Value], place: str) -> Value:
    """Return a text, a list or an object of JSON.

    Raises:
        InvalidDocument: It is of another kind.
    """
    if not isinstance(value, kind):
        raise fault_at(place, f"expected {describe_kind(kind())}, got {str(value)[:40]!r}")
    return value


def read_speed(value: object, place: str, unit_mps: float = 1.0) -> float:
    """Return a speed limit in m/s; a text may name its own unit ("25 mph", "30km/h").

    Args:
        value: A number, its text, or a list of one.
        place: Where it stands.
        unit_mps: What one of the format's own unit is in m/s.

    Raises:
        InvalidDocument: It is none that a road has.
    """
    match = _SPEED.fullmatch(value) if isinstance(value, str) else None
    if match is not None:
        value = match[1].replace(",", ".")
        unit_mps = look_up(_UNITS_MPS | {"": unit_mps}, match[2].lower(), place)
    limit = read_number(value, place, 0.001, FASTEST_MPS / unit_mps)
    return limit if unit_mps == 1.0 else round(limit * unit_mps, 3)


class Doubts:
    """Parts of a document that were not understood or had to be assumed, counted for its notes.

    Attributes:
        faults: By the kind of what is left out with them.
    """

    def __init__(self) -> None:
        self.faults: dict[str, list[str]] = defaultdict(list)
        self._assumed = Counter[str]()

    @contextmanager
    def about(self, kind: str) -> Iterator[None]:
        """Count a fault of the block by the kind of what is left out with it."""
        try:
            yield
        except InvalidDocument as fault:
            self.faults[kind].append(": ".join(fault.problems[0]))

    def read(
        self, kind: str, read: Callable[..., Value | None], value: Any, *args: Any
    ) -> Value | None:
        """Return the value as read; None if it is absent or counted as a fault."""
        if value is not None:
            with self.about(kind):
                return read(value, *args)
        return None

    def read_all(
        self, kind: str, read: Callable[..., Value | None], rows: Iterable[tuple[Any, ...]]
    ) -> list[Value]:
        """Return the readable values, each from the arguments in a row."""
        return [made for row in rows if (made := self.read(kind, read, *row)) is not None]

    def doubt_unknown(
        self, kind: str, table: Mapping[Key, Any], names: Iterable[object], place: str
    ) -> None:
        """Count each name that a table does not have as a fault."""
        self.read_all(kind, look_up, ((table, name, place) for name in names))

    def index_last(self, kind: str, pairs: Collection[tuple[Key, Value]]) -> dict[Key, Value]:
        """Return the values by id; where several have one, the last counts and a note says so."""
        by_id = dict(pairs)
        self.assume(f"Of two {kind} with one id the last counts", len(pairs) - len(by_id))
        return by_id

    def assume(self, sentence: str, times: SupportsInt = 1) -> None:
        """Count an assumption, told as a sentence without its full stop."""
        self._assumed[sentence] += int(times)

    @property
    def notes(self) -> list[str]:
        """Sentences on all of it."""
        lost = "Not understood and left out: {} ({}); first {}.".format
        notes = [lost(kind, len(faults), faults[0]) for kind, faults in self.faults.items()]
        for text, times in self._assumed.items():
            notes += [f"{text}." if times == 1 else f"{text} ({times} times)."] * bool(times)
        return notes
