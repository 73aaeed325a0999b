"""Phrases: patterns of words with slots, and how they match tokens.

A pattern is a line such as `at? distance of? <length> ahead|behind`:

* `word` is that word, `a|b` either of them, a `?` at the end means that it may be missing;
* `<slot>` is whatever the slot of that name reads, `<name:slot>` keeps it under another name.

Articles and round brackets between the pieces of a pattern are passed over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from augment.instruction.tokens import Token

T = TypeVar("T")
Tokens = tuple[Token, ...]

_PASSED_OVER = frozenset({"the", "a", "an", "(", ")"})


class Found:
    """What the slots of a matched pattern read, by name."""

    def __init__(self, values: Mapping[str, object]) -> None:
        self._values = values

    def get(self, name: str, kind: type[T]) -> T:
        """The value of a slot that the pattern can't do without."""
        value = self._values[name]
        if not isinstance(value, kind):
            raise TypeError(f"slot {name!r} read {value!r}, not a {kind.__name__}")
        return value

    def maybe(self, name: str, kind: type[T]) -> T | None:
        """The value of an optional slot, None where it is missing."""
        return self.get(name, kind) if name in self._values else None


Build = Callable[[Found], object]
"""Makes the value of a phrase from what its slots read."""

Reading = tuple[int, object]
"""The index after the last token that was read, and the value."""

Reader = Callable[[Tokens, int], Iterator[Reading]]
"""Every way to read the tokens from an index on, the preferred one first."""


@dataclass(frozen=True, slots=True)
class _Piece:
    """One part of a pattern: words (any of them) or a slot."""

    words: frozenset[str]
    slot: str | None
    name: str
    optional: bool


@dataclass(frozen=True, slots=True)
class Phrase:
    """A pattern and the value it means, made from what its slots read."""

    pieces: tuple[_Piece, ...]
    build: Build

    def read(self, tokens: Tokens, start: int, slots: Mapping[str, Reader]) -> Iterator[Reading]:
        """Every way in which the pattern matches from `start` on."""
        for end, values in _match(self.pieces, tokens, start, slots, {}, begun=False):
            yield end, self.build(Found(values))

    def first_words(self) -> frozenset[str] | None:
        """The words that it can begin with, None where it can begin with a slot."""
        words: frozenset[str] = frozenset()
        for piece in self.pieces:
            if piece.slot:
                return None
            words |= piece.words
            if not piece.optional:
                break
        return words


def phrases(build: Build, *patterns: str) -> tuple[Phrase, ...]:
    """Patterns that mean the same.

    Raises:
        ValueError: A pattern is empty or could match nothing at all.
    """
    made = tuple(Phrase(tuple(map(_piece, line.split())), build) for line in patterns)
    for line, phrase in zip(patterns, made, strict=True):
        if all(piece.optional for piece in phrase.pieces):
            raise ValueError(f"the pattern {line!r} could match nothing")
    return made


def means(value: object) -> Build:
    """A build that always gives the same value."""
    return lambda _: value


def alternatives(options: tuple[Phrase, ...], slots: Mapping[str, Reader]) -> Reader:
    """A slot that reads any of the phrases, which may use the given slots (looked up late)."""

    def read(tokens: Tokens, start: int) -> Iterator[Reading]:
        for option in options:
            yield from option.read(tokens, start, slots)

    return read


# Private


def _piece(text: str) -> _Piece:
    optional = text.endswith("?")
    core = text.removesuffix("?")
    if core.startswith("<") and core.endswith(">"):
        name, _, slot = core[1:-1].partition(":")
        return _Piece(frozenset(), slot or name, name, optional)
    return _Piece(frozenset(core.split("|")), None, "", optional)


def _match(
    pieces: tuple[_Piece, ...],
    tokens: Tokens,
    at: int,
    slots: Mapping[str, Reader],
    values: dict[str, object],
    *,
    begun: bool,
) -> Iterator[tuple[int, dict[str, object]]]:
    if not pieces:
        yield at, values
        return
    piece, rest = pieces[0], pieces[1:]
    for begin in _begins(tokens, at) if begun else (at,):
        for end, read in _read_piece(piece, tokens, begin, slots):
            kept = {**values, piece.name: read} if piece.slot else values
            yield from _match(rest, tokens, end, slots, kept, begun=True)
    if piece.optional:
        yield from _match(rest, tokens, at, slots, values, begun=begun)


def _begins(tokens: Tokens, at: int) -> Iterator[int]:
    """Where the next piece may begin: here, or behind at most two tokens that are passed over."""
    yield at
    for begin in (at + 1, at + 2):
        if begin > len(tokens) or tokens[begin - 1].text not in _PASSED_OVER:
            return
        yield begin


def _read_piece(
    piece: _Piece, tokens: Tokens, at: int, slots: Mapping[str, Reader]
) -> Iterator[Reading]:
    if piece.slot:
        yield from slots[piece.slot](tokens, at)
    elif at < len(tokens) and tokens[at].text in piece.words:
        yield at + 1, tokens[at].text
