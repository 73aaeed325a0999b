"""A sentence as tokens: words in lower case, numbers, and single marks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise

_TOKEN = re.compile(
    r"(?P<number>[0-9]+(?:[.,][0-9]+)*)|(?P<own>['’]s\b)|(?P<short>(?<=[^\W\d_])['’](?:d|ll|ve|re|m)\b)|(?P<word>[^\W\d_]+)|(?P<mark>\S)"
)
_WORD_JOINT = re.compile(r"(?<=[^\W_])[-‐‑](?=[^\W\d_])")
_SUBJECTS = frozenset({"there", "it", "that", "he", "she", "who", "here"})
"""Behind these "'s" is a verb, not an owner's mark."""

_PLAIN_NUMBER = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,6})?")


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of the text: what it says in lower case, where, and its number if it is one."""

    text: str
    start: int
    end: int
    number: float | None = None


def word_set(*lines: str) -> frozenset[str]:
    """The words of some lines."""
    return frozenset(word for line in lines for word in line.split())


def tokenize(text: str) -> tuple[Token, ...]:
    """The tokens of a text, left to right; a hyphen before a letter only parts words.

    A number in a form that has two readings ("1,5", "1.2.3") is a token without a number, which no
    rule reads.
    """
    parted = _WORD_JOINT.sub(" ", text)
    tokens = [_token(match) for match in _TOKEN.finditer(parted)]
    for at, (before, token) in enumerate(pairwise(tokens), start=1):
        if token.text == "'s" and before.text in _SUBJECTS:
            tokens[at] = Token("is", token.start, token.end)
    return tuple(tokens)


def _token(match: re.Match[str]) -> Token:
    text = match.group()
    number = None
    if match.lastgroup == "number" and _PLAIN_NUMBER.fullmatch(text):
        number = float(text)
    plain = "'s" if match.lastgroup == "own" else text.lower()
    return Token(plain, match.start(), match.end(), number)
