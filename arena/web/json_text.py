"""JSON that somebody typed or sent as a file."""

from __future__ import annotations

import json
from typing import Any

from augment.errors import Conflict


def read_json(text: str | bytes, *, otherwise: str) -> Any:
    """The value.

    Args:
        text: All of it.
        otherwise: What somebody is told whose text is no JSON.

    Raises:
        Conflict: It is none, or nested too deeply.
    """
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise Conflict(otherwise) from None
