"""Numbers in digits and in words: "21.4", "twenty-one point four", "two and a half"."""

from __future__ import annotations

from augment.instruction.phrases import Tokens

_UNITS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
_TEENS = (
    *("ten", "eleven", "twelve", "thirteen", "fourteen"),
    *("fifteen", "sixteen", "seventeen", "eighteen", "nineteen"),
)
_TENS = ("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")

NUMBER_WORDS: dict[str, int] = {
    **dict(zip(_UNITS, range(1, 10), strict=True)),
    **dict(zip(_TEENS, range(10, 20), strict=True)),
    **dict(zip(_TENS, range(20, 100, 10), strict=True)),
}
_DIGITS: dict[str, int] = {
    "zero": 0,
    "nought": 0,
    "oh": 0,
    **{word: NUMBER_WORDS[word] for word in _UNITS},
}


def read_number(tokens: Tokens, at: int) -> tuple[float | None, int]:
    """The number at an index and the index after it; None and the same index without one."""
    text = _text(tokens, at)
    if at < len(tokens) and (number := tokens[at].number) is not None:
        return _with_half(number, tokens, at + 1)
    if text == "half":
        following = _text(tokens, at + 1)
        return 0.5, at + 1 + (following in {"a", "of"}) + (following == "of")
    if text == "zero" and _text(tokens, at + 1) != "point":
        return 0.0, at + 1
    whole, end = _read_whole(tokens, at)
    if whole is None:
        return None, at
    if _text(tokens, end) == "point" and _text(tokens, end + 1) in _DIGITS:
        digits, end = _read_digits(tokens, end + 1)
        return float(f"{whole}.{digits}"), end
    return _with_half(float(whole), tokens, end)


# Private


def _read_whole(tokens: Tokens, at: int) -> tuple[int | None, int]:
    text = _text(tokens, at)
    if text in {"zero", "nought"}:
        return 0, at + 1
    if text in {"a", "one"} and _text(tokens, at + 1) == "hundred":
        rest, end = _read_below_hundred(tokens, at + 2 + (_text(tokens, at + 2) == "and"))
        return (100, at + 2) if rest is None else (100 + rest, end)
    return _read_below_hundred(tokens, at)


def _read_below_hundred(tokens: Tokens, at: int) -> tuple[int | None, int]:
    text = _text(tokens, at)
    if text not in NUMBER_WORDS:
        return None, at
    if text in _TENS and _text(tokens, at + 1) in _UNITS:
        return NUMBER_WORDS[text] + NUMBER_WORDS[_text(tokens, at + 1)], at + 2
    return NUMBER_WORDS[text], at + 1


def _read_digits(tokens: Tokens, at: int) -> tuple[str, int]:
    digits = ""
    while _text(tokens, at) in _DIGITS and len(digits) < 6:
        digits += str(_DIGITS[_text(tokens, at)])
        at += 1
    return digits, at


def _with_half(number: float, tokens: Tokens, at: int) -> tuple[float, int]:
    following = [_text(tokens, at + offset) for offset in range(3)]
    return (number + 0.5, at + 3) if following == ["and", "a", "half"] else (number, at)


def _text(tokens: Tokens, at: int) -> str:
    return tokens[at].text if at < len(tokens) else ""
