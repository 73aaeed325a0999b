"""Eight clients at once, each in a thread with a connection of its own; what their turns took."""

from __future__ import annotations

import http.client
import json
import statistics
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

Turn = Callable[[], Mapping[str, float]]
"""One loop of a client: milliseconds by phase; it raises `Refused` where the server did."""


class Refused(Exception):
    """The server answered otherwise than it should."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What one run of all clients took.

    Attributes:
        times_ms: Per phase one entry a turn.
        elapsed_s: From the first request to the last answer.
        errors: Turns that were refused, the first few in words.
    """

    times_ms: dict[str, list[float]]
    elapsed_s: float
    errors: list[str]

    def per_second(self, phase: str) -> float:
        return len(self.times_ms[phase]) / self.elapsed_s

    def median_ms(self, phase: str) -> float:
        return statistics.median(self.times_ms[phase])

    def p95_ms(self, phase: str) -> float:
        return statistics.quantiles(self.times_ms[phase], n=20)[-1]

    def max_ms(self, phase: str) -> float:
        return max(self.times_ms[phase])


def drive(clients: Sequence[Turn], *, turns: int) -> Run:
    """Let every client take its turns, all at once."""
    times: dict[str, list[float]] = defaultdict(list)
    errors: list[str] = []
    lock = threading.Lock()
    ready = threading.Barrier(len(clients) + 1)

    def work(client: Turn) -> None:
        ready.wait()
        for _ in range(turns):
            try:
                taken = client()
            except (Refused, OSError, http.client.HTTPException) as error:
                with lock:
                    errors.append(f"{type(error).__name__}: {error}"[:300])
                continue
            with lock:
                for phase, ms in taken.items():
                    times[phase].append(ms)

    threads = [threading.Thread(target=work, args=(client,)) for client in clients]
    for thread in threads:
        thread.start()
    ready.wait()
    start = time.perf_counter()
    for thread in threads:
        thread.join()
    return Run(times_ms=dict(times), elapsed_s=time.perf_counter() - start, errors=errors)


class Connection:
    """One kept-alive connection that speaks JSON and keeps cookies."""

    def __init__(self, port: int, headers: Mapping[str, str] | None = None) -> None:
        self._wire = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        self.headers = dict(headers or {})
        self.cookies: dict[str, str] = {}
        self._used = 0.0

    def ask(
        self, method: str, path: str, body: object = None, *, expect: Sequence[int] = (200,)
    ) -> bytes:
        """The body of the answer.

        Raises:
            Refused: The status is another than expected.
        """
        headers = dict(self.headers)
        if self.cookies:
            headers["Cookie"] = "; ".join(f"{name}={v}" for name, v in self.cookies.items())
        if "csrftoken" in self.cookies:
            headers["X-CSRFToken"] = self.cookies["csrftoken"]
        sent = body.encode() if isinstance(body, str) else None
        if body is not None and sent is None:
            sent = json.dumps(body).encode()
            headers["Content-Type"] = "application/json"
        elif sent is not None:
            headers["Content-Type"] = "application/x-www-form-urlencoded"
        if time.monotonic() - self._used > 1.0:  # servers hang up on those who are silent
            self._wire.close()
        try:
            self._wire.request(method, path, sent, headers)
            answer = self._wire.getresponse()
            found = answer.read()
        except (OSError, http.client.HTTPException):
            self._wire.close()
            raise
        self._used = time.monotonic()
        for line in answer.headers.get_all("Set-Cookie", []):
            name, _, value = line.split(";", 1)[0].partition("=")
            self.cookies[name] = value
        if answer.status not in expect:
            raise Refused(f"{method} {path} answered {answer.status}: {found[:200]!r}")
        return found

    def close(self) -> None:
        self._wire.close()


def timed(call: Callable[[], bytes]) -> tuple[bytes, float]:
    """What a call gave, and the milliseconds it took."""
    start = time.perf_counter()
    found = call()
    return found, 1000.0 * (time.perf_counter() - start)
