"""Sentences as a snapshot keeps them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import PlainValidator

from augment.sentences import read_sentence


def _read(kept: Any) -> str:
    if isinstance(kept, dict):
        return read_sentence(kept)
    if not isinstance(kept, str):
        raise ValueError(f"a sentence or plain text is allowed, not {kept!r}")
    return kept


Kept = Annotated[str, PlainValidator(_read)]
"""A sentence; older ones are plain text."""
