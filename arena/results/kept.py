"""Sentences as a snapshot keeps them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import PlainValidator


def read_text(stored: Any) -> str:
    """Return a kept sentence; versions before kept its text and the values of its places apart.

    Raises:
        ValueError: It is neither.
    """
    if isinstance(stored, dict):
        values = {name: _joined(value) for name, value in stored["values"].items()}
        return str(stored["text"] % values)
    if not isinstance(stored, str):
        raise ValueError(f"a sentence or plain text is allowed, not {stored!r}")
    return stored


def _joined(value: Any) -> Any:
    """A value in words: names by commas, groups of names by semicolons."""
    if not isinstance(value, list):
        return value
    between = "; " if any(isinstance(part, list) for part in value) else ", "
    return between.join(", ".join(part) if isinstance(part, list) else part for part in value)


Kept = Annotated[str, PlainValidator(read_text)]
