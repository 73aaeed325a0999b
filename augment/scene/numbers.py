"""Numbers in documents of intents and modifications: named by their paths, set, drawn.

A path is the one that faults are told by: `requests[0].spot.distance`, `add[0].speed_mps`. A range
(`low_m` or `low`, and high) is one number, and setting it makes it exact.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from augment.errors import InvalidDocument, check_names
from augment.scene.schema import path

# Of one sweep.
MOST_VALUES = 100
_FRAME = ("format", "version")
_LOW, _HIGH = "low", "high"
# Decimals of a swept value.
_DIGITS = 6


def list_numbers(document: Mapping[str, Any]) -> dict[str, float]:
    """Return every number of a document as it stands, by its path; of a range its lower end."""
    numbers: dict[str, float] = {}

    def note(steps: tuple[int | str, ...], part: Any) -> Any:
        numbers[path(*steps)] = float(part[_low_key(part)] if isinstance(part, dict) else part)
        return part

    _map_numbers(document, note)
    return numbers


def set_number(document: Mapping[str, Any], name: str, value: float) -> dict[str, Any]:
    """Return the document with another number at one path.

    Raises:
        UnknownName: There is no number at that path.
    """
    numbers = list_numbers(document)
    check_names("number", [name], numbers)
    changed: dict[str, Any] = _map_numbers(
        document, lambda steps, part: _exact(part, value) if path(*steps) == name else part
    )
    return changed


def draw_ranges(document: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the document with an evenly drawn number, to centimetres, for each of its ranges."""

    def draw(_steps: tuple[int | str, ...], part: Any) -> Any:
        if not isinstance(part, dict):
            return part
        low: float = part[_low_key(part)]
        high: float = part.get("high" + _low_key(part).removeprefix("low"), low)
        return part if high == low else _exact(part, round(float(rng.uniform(low, high)), 2))

    drawn: dict[str, Any] = _map_numbers(document, draw)
    return drawn


def sweep_values(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return evenly spaced numbers from `low` to `high`.

    Raises:
        InvalidDocument: These bounds make no such numbers.
    """
    problems = []
    if not 2 <= count <= MOST_VALUES:
        problems.append(("count", f"goes from 2 to {MOST_VALUES}, not {count}"))
    if not -1e6 <= low < high <= 1e6:  # NaN is refused as well
        problems.append(("high", f"must be a number above low, got {low:g} to {high:g}"))
    elif high - low < count * 10.0**-_DIGITS:
        problems.append(("high", f"{low:g} to {high:g} is too short for {count} values"))
    if problems:
        raise InvalidDocument("sweep", problems)
    return tuple(round(float(value), _DIGITS) for value in np.linspace(low, high, count))


# Private


def _map_numbers(
    document: Mapping[str, Any], change: Callable[[tuple[int | str, ...], Any], Any]
) -> Any:
    """Return a copy with each number and each range replaced by what `change` makes of it."""

    def walk(part: Any, steps: tuple[int | str, ...]) -> Any:
        if isinstance(part, dict) and steps and _low_key(part):
            return change(steps, part)
        if isinstance(part, Mapping):
            return {
                key: value if not steps and key in _FRAME else walk(value, (*steps, key))
                for key, value in part.items()
            }
        if isinstance(part, list | tuple):
            return [walk(value, (*steps, index)) for index, value in enumerate(part)]
        is_number = isinstance(part, int | float) and not isinstance(part, bool)
        return change(steps, part) if is_number else part

    return walk(document, ())


def _low_key(part: Mapping[str, Any]) -> str:
    return next((key for key in part if key.partition("_")[0] == "low"), "")


def _exact(part: Any, value: float) -> Any:
    number = int(value) if value.is_integer() else value  # counts are whole numbers
    return {_low_key(part): number} if isinstance(part, dict) else number
