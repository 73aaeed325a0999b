"""Text that came out of files and models, as it may be printed or written into a comment."""

import unicodedata


def escape_controls(text: str) -> str:
    """The text as it may be printed: what steers a terminal is spelt out as in Python.

    Control characters, among them those that begin terminal sequences, characters that turn the
    direction of reading or are invisible, and separators of lines. A line feed and a tab stay.
    """
    return "".join(
        character if _is_plain(character) else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


def _is_plain(character: str) -> bool:
    if character in "\n\t" or " " <= character <= "~":
        return True
    return unicodedata.category(character) not in {"Cc", "Cf", "Cs", "Zl", "Zp"}
