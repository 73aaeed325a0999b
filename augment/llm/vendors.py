"""Meanings of vendors' words, from `vendors.toml`. Pure."""

import re
import tomllib
from functools import cache
from importlib.resources import files

_LONGEST = 4_000
"""So much of a text is looked at: some patterns take a time that grows with its square."""


def says(meaning: str, text: str, *, name: str = "") -> bool:
    """Return whether a text says something in some vendor's words.

    Args:
        meaning: A list of the file.
        text: A sentence, a code or a finish reason.
        name: The parameter that it is about, under the names that the file has for it.
    """
    return _pattern(meaning, name).search(text, 0, _LONGEST) is not None


def names_of(meaning: str) -> list[str]:
    """Return the names under which vendors write something: a list of the file, in its order."""
    return _words()[meaning]


@cache
def _words() -> dict[str, list[str]]:
    return tomllib.loads(files(__package__).joinpath("vendors.toml").read_text("utf-8"))


@cache
def _pattern(meaning: str, name: str) -> re.Pattern[str]:
    words = _words()
    names = "|".join(words.get(name, [name.replace("_", "_?")]))
    text = "|".join(words[meaning]).replace("NAME", f"({names})")
    for part in ("noun", "unknown"):
        text = text.replace(part.upper(), f"({'|'.join(words[part])})")
    return re.compile(text.replace("_?", r"[\W_]?"), re.IGNORECASE | re.DOTALL)
