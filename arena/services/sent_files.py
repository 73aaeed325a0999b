"""Files that come with a request, before anybody has looked at them."""

from __future__ import annotations

from collections.abc import Mapping

FILE_TOO_LARGE = "arena.file_too_large"
"""In the META of a request one of whose files was let pass by unread."""


def was_too_large(meta: Mapping[str, object]) -> bool:
    """Whether a file was larger than any may be; it is not among the files then."""
    return bool(meta.get(FILE_TOO_LARGE))
