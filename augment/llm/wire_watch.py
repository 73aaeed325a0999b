"""What ends one call before its answer is there: its time, its size, or that nobody wants it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from augment.errors import Unwanted

LOOK_EVERY_S = 1.0
"""So often somebody who waits for an answer asks whether it is still wanted."""

_BESIDE_THE_BODY = 256 * 1024
"""What may come beside a body: status, headers, the sizes of chunks. One header block of more
than 100 kB is refused by the HTTP parser anyway."""

_SHORTEST_S = 0.001


class OutOfTime(Exception):
    """The call has had its time."""


class TooLong(Exception):
    """More came than an answer may have."""


class Watch:
    """Over one call, from before its connection to the last byte of its answer.

    Args:
        longest_s: The call's whole time.
        most_bytes: Of a body, unpacked.
        still_wanted: Raises Unwanted where nobody needs the answer any more.
        look_every_s: How often it is asked that.
        clock: Seconds that never go back.

    Attributes:
        has_written: Whether anything was sent.
        ended_by: Why it ended the call, None where it did not.
    """

    def __init__(
        self,
        *,
        longest_s: float,
        most_bytes: int,
        still_wanted: Callable[[], None],
        look_every_s: float = LOOK_EVERY_S,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.most_bytes = most_bytes
        self.has_written = False
        self.ended_by: OutOfTime | TooLong | Unwanted | None = None
        self._still_wanted, self._look_every_s, self._clock = still_wanted, look_every_s, clock
        self._ends_at = clock() + longest_s
        self._looks_at = clock() + look_every_s
        self._came = 0

    def wait_s(self) -> float:
        """How long to wait for the network at once, before asking here again.

        Raises:
            OutOfTime: No longer.
            Unwanted: Nobody needs it.
        """
        now = self._clock()
        if now >= self._ends_at:
            raise self._end(OutOfTime())
        if now >= self._looks_at:
            self._looks_at = now + self._look_every_s
            try:
                self._still_wanted()
            except Unwanted as why:
                raise self._end(why) from None
        return max(min(self._ends_at, self._looks_at) - now, _SHORTEST_S)

    def left_s(self) -> float:
        """How long the call may still take.

        Raises:
            OutOfTime: No longer.
        """
        left_s = self._ends_at - self._clock()
        if left_s <= 0:
            raise self._end(OutOfTime())
        return left_s

    def came(self, count: int) -> None:
        """Count bytes as they came over the network.

        Raises:
            TooLong: They are more than any answer may have.
        """
        self._came += count
        if self._came > self.most_bytes + _BESIDE_THE_BODY:
            raise self.too_long()

    def too_long(self) -> TooLong:
        """The end of a call with too much in it, to be raised."""
        self.ended_by = TooLong()
        return self.ended_by

    def _end(self, why: OutOfTime | Unwanted) -> OutOfTime | Unwanted:
        self.ended_by = why
        return why


class Watches:
    """The watch of each thread's call: a connection is used by one thread at a time."""

    def __init__(self) -> None:
        self._local = threading.local()

    @contextmanager
    def over(self, watch: Watch) -> Iterator[Watch]:
        """Let this watch be the thread's while the block runs."""
        self._local.watch = watch
        try:
            yield watch
        finally:
            del self._local.watch

    def now(self) -> Watch:
        """The watch over this thread's call."""
        watch: Watch = self._local.watch
        return watch
