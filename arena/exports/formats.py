"""What all writers share: what a format is, and how a value stands in a cell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

Table = TypeVar("Table")


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Generic[Table]):
    """How a table can be written.

    Attributes:
        suffix: Of the file's name, without the dot.
        write: Makes the file's bytes.
    """

    suffix: str
    content_type: str
    is_text: bool
    write: Callable[[Table], bytes]


def cell(value: object) -> str:
    """A cell that no spreadsheet takes for a formula."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.2f}"
    text = str(value)
    guard = "'" if text.startswith(("=", "+", "-", "@", "\t", "\r", "\n")) else ""
    return guard + text.replace("\r", " ").replace("\n", " ")


def rounded(value: float | None) -> float | None:
    """Four decimals, which every machine agrees on."""
    return None if value is None else round(value, 4)
