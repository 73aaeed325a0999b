"""The prompt texts, package data under `text/`: read, filled and counted into a version."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from augment.llm.messages import Message, Speaker

QUOTE = "> "
"""Stands before every line of somebody else's words: no line of them can end the quotation."""

LONGEST_ECHO = 20_000

VECTORS_VERSION = 4
"""Raised with every change to what of a scene is written down, or how: no text shows that."""


@cache
def prompt_version() -> str:
    """Twelve hexadecimal digits that change with every change to any prompt text or form."""
    digest = hashlib.sha256(b"vectors %d\0" % VECTORS_VERSION)
    for entry in sorted(files(__package__).joinpath("text").iterdir(), key=lambda e: e.name):
        digest.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


@cache
def read_text(name: str) -> str:
    """The text of that name as it stands in its file."""
    return files(__package__).joinpath("text", name).read_text(encoding="utf-8").strip()


def fill_text(name: str, **values: str) -> str:
    """The text with each {{name}} replaced once; what is filled in is not looked at again.

    Raises:
        KeyError: A name has no value.
    """
    parts = []
    rest = read_text(name)
    while "{{" in rest:
        before, _, rest = rest.partition("{{")
        key, _, rest = rest.partition("}}")
        parts += [before, values[key]]
    return re.sub(r"\n{3,}", "\n\n", "".join([*parts, rest])).strip()


def quote(words: str) -> str:
    """Somebody's words as a quotation, line by line, without control characters."""
    clean = ("".join(map(_printable, line)).strip() for line in words.splitlines())
    return "\n".join(QUOTE + line for line in clean if line)


def model_message(answer: str) -> Message:
    """A turn of the model; an empty one is refused by several servers."""
    return Message(speaker=Speaker.ASSISTANT, text=answer[:LONGEST_ECHO] or "(empty answer)")


def said_by_user(words: str, *, images: tuple[bytes, ...] = ()) -> Message:
    """A turn of whoever talks to the model."""
    return Message(speaker=Speaker.USER, text=words, images=images)


def number_lines(entries: Sequence[str]) -> str:
    """The entries as a numbered list, each on one line."""
    return "\n".join(f"{n}. {' '.join(entry.split())}" for n, entry in enumerate(entries, 1))


def _printable(character: str) -> str:
    return " " if unicodedata.category(character).startswith("C") else character
