"""How long to wait before the same request is sent again."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from augment.errors import ModelFault


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """Exponential back-off with jitter, bounded by a number of attempts and by a longest wait.

    Attributes:
        attempts: How often one request is sent at most.
        first_wait_s: The wait after the first fault; it doubles from one to the next.
        longest_wait_s: No wait is longer; who is asked to wait longer (Retry-After) gives up.
        sleep: Waits for that many seconds.
        rng: Where the jitter comes from.
    """

    attempts: int = 3
    first_wait_s: float = 1.0
    longest_wait_s: float = 30.0
    sleep: Callable[[float], None] = time.sleep
    rng: random.Random = field(default_factory=random.Random)

    def wait_s(self, fault: ModelFault, *, attempt: int) -> float | None:
        """Seconds to wait after that attempt (the first is 1), None to give up.

        The jitter takes away up to half of the back-off. What the endpoint asked for with
        Retry-After is never undercut.
        """
        if not fault.retryable or attempt >= self.attempts:
            return None
        asked_s = fault.retry_after_s or 0.0
        if asked_s > self.longest_wait_s:
            return None
        backoff_s = min(self.first_wait_s * 2.0 ** (attempt - 1), self.longest_wait_s)
        return max(asked_s, backoff_s * (1.0 - 0.5 * self.rng.random()))
