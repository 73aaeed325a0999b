"""Slots that read numbers: counts, lengths, angles, speeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from augment.instruction.intent import Length
from augment.instruction.numbers import NUMBER_WORDS, read_number
from augment.instruction.phrases import Reading, Tokens
from augment.instruction.tokens import word_set

_ONE = frozenset({"a", "an", "single", "another"})

METRES: dict[str, float] = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters", "mtr"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
    **dict.fromkeys(("yd", "yds", "yard", "yards"), 0.9144),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), 1000.0),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 0.01),
}
"""Metres in one of each unit; inches are left out, since "in" is mostly another word."""

_SPELT = frozenset({"metre", "meter", "foot", "yard"})
_PER_SECOND = ("second", "sec", "s")
_PER_HOUR = ("hour", "h", "hr")
_SPEEDS: dict[tuple[str, ...], float] = {
    ("m", "/", "s"): 1.0,
    ("m", "s"): 1.0,
    ("mps",): 1.0,
    **{
        (unit, joint, second): 1.0
        for unit in ("m", "metre", "metres", "meter", "meters")
        for joint in ("per", "a")
        for second in _PER_SECOND
    },
    ("km", "/", "h"): 1.0 / 3.6,
    ("kmh",): 1.0 / 3.6,
    ("kph",): 1.0 / 3.6,
    **{
        (unit, joint, hour): 1.0 / 3.6
        for unit in ("km", "kilometre", "kilometres", "kilometer", "kilometers")
        for joint in ("per", "an", "a")
        for hour in _PER_HOUR
    },
    ("mph",): 0.44704,
    ("miles", "per", "hour"): 0.44704,
    ("miles", "an", "hour"): 0.44704,
}
_DEGREES = frozenset({"°", "º", "degree", "degrees", "deg"})
_APPROXIMATELY = word_set(
    "approx approximate approximately about around roughly circa ca some ~ ≈ nearly almost"
)
_EXACTLY = frozenset({"exactly", "precisely", "just", "only"})
QUANTITY_WORDS = (
    _APPROXIMATELY
    | _EXACTLY
    | _ONE
    | frozenset(NUMBER_WORDS)
    | word_set("half zero nought between from pair couple right one")
)
"""What a quantity can begin with, digits apart."""

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
    """A whole number in digits or in words; an article counts as one, a pair as two."""
    if at >= len(tokens):
        return
    text = tokens[at].text
    if text in _ONE:
        yield at + 1, 1
        if [_text(tokens, at + 1), _text(tokens, at + 2)] in (["pair", "of"], ["couple", "of"]):
            yield at + 3, 2
        elif text == "a" and _text(tokens, at + 1) == "single":
            yield at + 2, 1
    elif text in {"pair", "couple"} and _text(tokens, at + 1) == "of":
        yield at + 2, 2
    elif text == "one" and _text(tokens, at + 1) in {"more", "other", "single"}:
        yield at + 2, 1
    number, end = read_number(tokens, at)
    if number is not None and number.is_integer():
        yield end, int(number)


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
        if [_text(tokens, end), _text(tokens, end + 1)] == ["or", "so"]:
            yield end + 2, Length(low_m=size, high_m=size, is_approximate=True)


def read_angle(tokens: Tokens, at: int) -> Iterator[Reading]:
    """An angle: "30 degrees", "about 80°", "a right angle"."""
    if _text(tokens, at) == "right" and _text(tokens, at + 1) in {"angle", "angles"}:
        yield at + 2, Angle(90.0)
    at, _ = _read_about(tokens, at)
    number, end = read_number(tokens, at)
    if number is not None and _text(tokens, end) in _DEGREES:
        yield end + 1, Angle(number)


def read_speed(tokens: Tokens, at: int) -> Iterator[Reading]:
    """A speed: "8 m/s", "30 km/h", "ten metres per second"."""
    at, _ = _read_about(tokens, at)
    number, at = read_number(tokens, at)
    if number is None:
        return
    for unit, factor in _SPEEDS.items():
        end = at + len(unit)
        if tuple(token.text for token in tokens[at:end]) == unit:
            yield end, Speed(number * factor)


# Private


def _read_about(tokens: Tokens, at: int) -> tuple[int, bool]:
    if _text(tokens, at) in _EXACTLY:
        return at + 1, False
    if _text(tokens, at) not in _APPROXIMATELY:
        return at, False
    abbreviated = _text(tokens, at) in {"approx", "ca"} and _text(tokens, at + 1) == "."
    return at + 1 + abbreviated, True


def _read_amount(tokens: Tokens, at: int) -> tuple[float | None, float | None, int]:
    """The number at an index, the metres in its unit if one follows, and the index after."""
    number, end = read_number(tokens, at)
    if number is None and _text(tokens, at) in {"a", "an"} and _text(tokens, at + 1) in _SPELT:
        number, end = 1.0, at + 1
    if number is None:
        return None, None, at
    unit = METRES.get(_text(tokens, end))
    following = _text(tokens, end + 1), _text(tokens, end + 2)
    rate = following[0] in {"/", "per", "a", "an"} and following[1] in {*_PER_SECOND, *_PER_HOUR}
    if unit is None or rate:
        return number, None, end
    if following == ("and", "a") and _text(tokens, end + 3) == "half":
        return number + 0.5, unit, end + 4
    return number, unit, end + 1


def _text(tokens: Tokens, at: int) -> str:
    return tokens[at].text if at < len(tokens) else ""
