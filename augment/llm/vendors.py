"""Meanings of vendors' words, from `vendors.toml`. Pure."""

import re
import tomllib
from functools import cache
from importlib.resources import files


def says(meaning: str, text: str, *, name: str = "") -> bool:
    """Return whether a text says something in some vendor's words.

    Args:
        meaning: A list of the file.
        text: A sentence, a code or a finish reason.
        name: The parameter that it is about.
    """
    return _pattern(meaning, name).search(text) is not None


@cache
def _pattern(meaning: str, name: str) -> re.Pattern[str]:
    words = tomllib.loads(files(__package__).joinpath("vendors.toml").read_text("utf-8"))
    text = "|".join(words[meaning]).replace("NAME", name.replace("_", "_?"))
    for part in ("noun", "unknown"):
        text = text.replace(part.upper(), f"({'|'.join(words[part])})")
    return re.compile(text.replace("_?", r"[\W_]?"), re.IGNORECASE | re.DOTALL)
