"""Sentences for people, in English, and what they were made of: no language is chosen here.

Whoever shows them in another language looks up the text and fills in the values again. What is
stored, logged or printed is the English sentence.
"""

from __future__ import annotations

import unicodedata
from typing import Any

Value = int | str | tuple[str, ...] | tuple[tuple[str, ...], ...]
"""A number, a name, a list of names, or groups of names; a sentence is looked up as well."""


class Sentence(str):
    """An English sentence that remembers its text and values.

    Attributes:
        text: With a named place, as in `%(number)s`, for every value.
        values: By the names of their places.
    """

    text: str
    values: dict[str, Value]

    def as_document(self) -> dict[str, Any]:
        """What `read_sentence` makes the sentence of again, as JSON would give it back.

        Sentences within become names.
        """
        return {"text": self.text, "values": {k: _plain(v) for k, v in self.values.items()}}


def sentence(text: str, /, **values: Value) -> Sentence:
    """The sentence of a text and its values; the text stands in the catalogue of translations."""
    made = Sentence(fill_sentence(text, values))
    made.text, made.values = text, values
    return made


def word(text: str) -> Sentence:
    """A word of ours as a value, to be looked up with its sentence; `sentence` takes names."""
    return sentence(text.replace("%", "%%"))


def sentence_of(error: Exception) -> str:
    """What an error says: the sentence that it was raised with, else its plain text."""
    first = error.args[0] if error.args else ""
    return first if isinstance(first, Sentence) else str(error)


def fill_sentence(text: str, values: dict[str, Value]) -> str:
    """The text with its values; names are joined by commas, groups of names by semicolons."""
    return text % {name: _written(value) for name, value in values.items()}


def read_sentence(document: dict[str, Any]) -> Sentence:
    """The sentence of what `as_document` gave, also after a way through JSON."""
    return sentence(
        document["text"], **{name: _read(value) for name, value in document["values"].items()}
    )


def escape_controls(text: str) -> str:
    """The text as it may be printed: what steers a terminal is spelt out as in Python.

    Control characters, among them those that begin terminal sequences, characters that turn the
    direction of reading or are invisible, and separators of lines. A line feed and a tab stay.
    """
    return "".join(character if _is_plain(character) else _spelt(character) for character in text)


def _is_plain(character: str) -> bool:
    if character in "\n\t" or " " <= character <= "~":
        return True
    return unicodedata.category(character) not in {"Cc", "Cf", "Cs", "Zl", "Zp"}


def _spelt(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def _written(value: Value) -> str:
    if not isinstance(value, tuple):
        return str(value)
    nested = [", ".join(part) if isinstance(part, tuple) else part for part in value]
    return ("; " if any(isinstance(part, tuple) for part in value) else ", ").join(nested)


def _plain(value: Any) -> Any:
    """Tuples as lists."""
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _read(value: Any) -> Value:
    if isinstance(value, list | tuple):
        return tuple(tuple(part) if isinstance(part, list) else part for part in value)
    made: int | str = value
    return made
