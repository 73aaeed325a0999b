"""Slots that read numbers: counts, lengths, angles, speeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from augment.instruction.intent import Length
from augment.instruction.phrases import Reading, Tokens

_WORDS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven")
NUMBER_WORDS = {word: number for number, word in enumerate((*_WORDS, "twelve"), start=1)}
_ONE = frozenset({"a", "an", "single"})

METRES = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
    **dict.fromkeys(("yd", "yard", "yards"), 0.9144),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), 1000.0),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 0.01),
}
"""Metres in one of each unit; inches are left out, since "in" is mostly another word."""

_SPEEDS = {
    ("m", "/", "s"): 1.0,
    ("mps",): 1.0,
    ("metres", "per", "second"): 1.0,
    ("meters", "per", "second"): 1.0,
    ("km", "/", "h"): 1.0 / 3.6,
    ("kmh",): 1.0 / 3.6,
    ("kph",): 1.0 / 3.6,
    ("mph",): 0.44704,
}
_DEGREES = frozenset({"°", "degree", "degrees", "deg"})
_APPROXIMATELY = frozenset(
    {"approx", "approximate", "approximately", "about", "around", "roughly", "circa", "some", "~"}
)
_UP_TO = frozenset({"-", "–", "—", "to"})


@dataclass(frozen=True, slots=True)
class Angle:
    """An angle in degrees, as the sentence gives it."""

    degrees: float


@dataclass(frozen=True, slots=True)
class Speed:
    """A speed in m/s."""

    mps: float


def read_count(tokens: Tokens, at: int) -> Iterator[Reading]:
    """A whole number in digits or in words from one to twelve; an article counts as one."""
    if at >= len(tokens):
        return
    token = tokens[at]
    if token.text in _ONE:
        yield at + 1, 1
    elif token.text in NUMBER_WORDS:
        yield at + 1, NUMBER_WORDS[token.text]
    elif token.number is not None and token.number.is_integer():
        yield at + 1, int(token.number)


def read_length(tokens: Tokens, at: int) -> Iterator[Reading]:
    """A length or a range of lengths with its unit: "about 21.4m", "between 15 and 20 m"."""
    at, about = _read_about(tokens, at)
    between = _text(tokens, at) in {"between", "from"}
    first, unit, end = _read_amount(tokens, at + between)
    if first is None:
        return
    joint = _text(tokens, end)
    if joint in _UP_TO or (between and joint == "and"):
        second, last_unit, last = _read_amount(tokens, end + 1)
        if second is not None and last_unit is not None:
            low, high = first * (unit or last_unit), second * last_unit
            if low <= high:
                yield last, Length(low_m=low, high_m=high, is_approximate=about)
    if unit is not None and not between:
        size = first * unit
        yield end, Length(low_m=size, high_m=size, is_approximate=about)


def read_angle(tokens: Tokens, at: int) -> Iterator[Reading]:
    """An angle: "30 degrees", "about 80°"."""
    at, _ = _read_about(tokens, at)
    if _text(tokens, at + 1) in _DEGREES and (number := tokens[at].number) is not None:
        yield at + 2, Angle(number)


def read_speed(tokens: Tokens, at: int) -> Iterator[Reading]:
    """A speed: "8 m/s", "30 km/h"."""
    at, _ = _read_about(tokens, at)
    if at >= len(tokens) or (number := _number(tokens, at)) is None:
        return
    for unit, factor in _SPEEDS.items():
        end = at + 1 + len(unit)
        if tuple(token.text for token in tokens[at + 1 : end]) == unit:
            yield end, Speed(number * factor)


# Private


def _read_about(tokens: Tokens, at: int) -> tuple[int, bool]:
    if _text(tokens, at) not in _APPROXIMATELY:
        return at, False
    abbreviated = _text(tokens, at) == "approx" and _text(tokens, at + 1) == "."
    return at + 1 + abbreviated, True


def _read_amount(tokens: Tokens, at: int) -> tuple[float | None, float | None, int]:
    """The number at an index, the metres in its unit if one follows, and the index after."""
    number = _number(tokens, at)
    if number is None:
        return None, None, at
    unit = METRES.get(_text(tokens, at + 1))
    rate = _text(tokens, at + 2) in {"/", "per"} and _text(tokens, at + 3) in {"s", "h", "second"}
    if unit is None or rate:
        return number, None, at + 1
    return number, unit, at + 2


def _number(tokens: Tokens, at: int) -> float | None:
    if at >= len(tokens):
        return None
    token = tokens[at]
    if token.number is not None:
        return token.number
    word = NUMBER_WORDS.get(token.text)
    return None if word is None else float(word)


def _text(tokens: Tokens, at: int) -> str:
    return tokens[at].text if at < len(tokens) else ""
