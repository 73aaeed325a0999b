"""One line on a terminal that says how far long work is; nothing where nobody reads along."""

from collections.abc import Callable
from typing import TextIO

FIRST_S = 1.0
"""Work that takes no longer says nothing."""
EVERY_S = 0.2
_ERASE = "\r\x1b[K"


class ProgressLine:
    """Writes over itself, and is gone at the end.

    Args:
        stream: Standard error. Where it is no terminal nothing is written.
        now: A clock in seconds.
    """

    def __init__(self, stream: TextIO, now: Callable[[], float]) -> None:
        self._stream, self._now = stream, now
        self._shown = stream.isatty()
        self._next = now() + FIRST_S
        self._is_written = False

    def read(self, votes: int) -> None:
        """So many votes are read."""
        self._say(f"reading: {votes:,} votes")

    def drawn(self, done: int, rounds: int) -> None:
        """So many rounds are drawn."""
        self._say(f"drawing: {done:,} of {rounds:,} rounds")

    def end(self) -> None:
        """Leave nothing behind."""
        if self._is_written:
            self._stream.write(_ERASE)
            self._stream.flush()
            self._is_written = False

    def _say(self, text: str) -> None:
        if not self._shown or (now := self._now()) < self._next:
            return
        self._next = now + EVERY_S
        self._stream.write(_ERASE + text)
        self._stream.flush()
        self._is_written = True
