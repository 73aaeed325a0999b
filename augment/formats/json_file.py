"""JSON files from outside, read once and without surprises."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from augment.errors import InvalidDocument

MAX_BYTES = 64 * 1024 * 1024
MOST_PARTS = 600_000
"""Objects and lists: an empty one takes two bytes here and sixty in memory."""
MOST_VALUES = 2_000_000
_MOST_NAMED = 5
_LONGEST_NAMED = 40


def read_json(file: Path, *, what: str) -> object:
    """What the JSON file holds.

    Args:
        file: A file in UTF-8 of at most `MAX_BYTES`.
        what: The kind of document, for the sentence.

    Raises:
        InvalidDocument: No such file, too large, no JSON, a name twice in one object, or a text
            that no database takes.
    """
    try:
        size = file.stat().st_size
        if size > MAX_BYTES:
            text = f"{size} bytes; at most {MAX_BYTES} are read"
            raise InvalidDocument(what, [(file.name, text)])
        block = file.read_bytes()
        _check_counts(block)
        value = json.loads(block.decode("utf-8"), object_pairs_hook=_object)
        _check_texts(value)
        return value
    except OSError as fault:
        raise InvalidDocument(what, [(file.name, fault.strerror or "can't be read")]) from None
    except RecursionError:
        raise InvalidDocument(what, [(file.name, "is nested too deeply")]) from None
    except ValueError as fault:  # not JSON, not UTF-8, or a number of thousands of digits
        raise InvalidDocument(what, [(file.name, f"is not JSON: {fault}")]) from None


def _check_counts(block: bytes) -> None:
    """Raise ValueError for more than is read; brackets and commas within texts count too."""
    if block.count(b"{") + block.count(b"[") > MOST_PARTS:
        raise ValueError(f"more than {MOST_PARTS} objects and lists")
    if block.count(b",") > MOST_VALUES:
        raise ValueError(f"more than {MOST_VALUES} values")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        times = Counter(name for name, _ in pairs)
        doubled = sorted(name for name, count in times.items() if count > 1)
        shown = ", ".join(ascii(name[:_LONGEST_NAMED]) for name in doubled[:_MOST_NAMED])
        more = len(doubled) - _MOST_NAMED
        rest = f" and {more} more" if more > 0 else ""
        raise ValueError(f"named twice in one object: {shown}{rest}")
    return made


def _check_texts(value: object) -> None:
    """Raise ValueError for a text with NUL or half a character, which JSON can escape."""
    if isinstance(value, str):
        if "\0" in value:
            raise ValueError(f"NUL in {value[:40]!r}")
        value.encode()
    elif isinstance(value, dict):
        for name, item in value.items():
            _check_texts(name)
            _check_texts(item)
    elif isinstance(value, list):
        for item in value:
            _check_texts(item)
