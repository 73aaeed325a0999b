"""Long texts from outside, cut to a stated length with a mark that says so."""

from __future__ import annotations


def shorten(text: str, most: int) -> str:
    """The text, or its beginning with a mark of how long it was: at most `most` characters.

    Raises:
        ValueError: There is no room for the mark.
    """
    if len(text) <= most:
        return text
    mark = f"… [cut: {len(text)} characters]"
    if len(mark) >= most:
        raise ValueError(f"{most} characters leave no room for {mark!r}")
    return text[: most - len(mark)] + mark
