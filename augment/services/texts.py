"""Texts from outside as every database takes them."""

from __future__ import annotations

from typing import Any


def storable(text: str) -> str:
    """The text without what can't be stored: PostgreSQL has no NUL, UTF-8 no half characters."""
    return text.replace("\0", "\u2400").encode("utf-8", "backslashreplace").decode("utf-8")


def storable_document(value: Any) -> Any:
    """The JSON document with each of its texts storable."""
    if isinstance(value, str):
        return storable(value)
    if isinstance(value, dict):
        return {storable(key): storable_document(item) for key, item in value.items()}
    if isinstance(value, list):
        return [storable_document(item) for item in value]
    return value
