"""A sentence as tokens: words in lower case, numbers, and single marks."""

from __future__ import annotations

import re
from dataclasses import dataclass

_TOKEN = re.compile(
    r"(?P<number>[0-9]+(?:[.,][0-9]+)*)|(?P<own>['’]s\b)|(?P<word>[^\W\d_]+)|(?P<mark>\S)"
)
_WORD_JOINT = re.compile(r"(?<=[^\W\d_])[-‐‑](?=[^\W\d_])")
_PLAIN_NUMBER = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,6})?")


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of the text: what it says in lower case, where, and its number if it is one."""

    text: str
    start: int
    end: int
    number: float | None = None


def tokenize(text: str) -> tuple[Token, ...]:
    """The tokens of a text, left to right; a hyphen inside a word only parts it.

    A number in a form that has two readings ("1,5", "1.2.3") is a token without a number, which no
    rule reads.
    """
    parted = _WORD_JOINT.sub(" ", text)
    return tuple(_token(match) for match in _TOKEN.finditer(parted))


def _token(match: re.Match[str]) -> Token:
    text = match.group()
    number = None
    if match.lastgroup == "number" and _PLAIN_NUMBER.fullmatch(text):
        number = float(text)
    plain = "'s" if match.lastgroup == "own" else text.lower()
    return Token(plain, match.start(), match.end(), number)
