"""HTTP for the `openai` package that no server can hold up, swell or redirect.

A call ends with its time, with too much in its answer, or when nobody wants it any more. A
connection leads to the address that was checked. An answer is read whole, within a limit.
"""

from __future__ import annotations

import ssl
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from threading import Thread
from typing import TYPE_CHECKING

from augment.errors import InvalidDocument
from augment.llm.addresses import Resolve, resolve_host

if TYPE_CHECKING:
    import httpcore2
    import httpx2

LOOK_EVERY_S = 1.0
"""So often somebody who waits for an answer asks whether it is still wanted."""
CONNECT_TIMEOUT_S = 10.0
ACCEPTED = "identity"
"""Nothing is to come packed, for what it unpacks to has no bound."""

# What may come beside a body: status, headers, the sizes of chunks. One header block of more
# than 100 kB is refused by the HTTP parser anyway.
_BESIDE_THE_BODY = 256 * 1024
_AT_ONCE = 64 * 1024
_SHORTEST_S = 0.001
_MOST_CONNECTIONS = 100


class WireFault(Exception):
    """The call has no answer.

    Args:
        text: Why, with nothing of the request.
        retryable: Whether the same request may succeed later.
        status: Of a success whose body can't be read.
    """

    def __init__(self, text: str, *, retryable: bool = True, status: int | None = None) -> None:
        super().__init__(text)
        self.retryable, self.status = retryable, status


class OutOfTime(WireFault):
    """The call has had its time."""


class UnusableBody(WireFault):
    """The body of a success is longer than an answer may be, or comes packed."""


class Watch:
    """The limits of one call, from before its connection to the last byte of its answer.

    Args:
        longest_s: The call's whole time.
        most_bytes: Of a body, unpacked.
        still_wanted: Raises Unwanted where nobody needs the answer any more.
        look_every_s: How often it is asked that.
        clock: Seconds that never go back.

    Attributes:
        has_written: Whether anything was sent.
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
        self._longest_s = longest_s
        self._still_wanted, self._look_every_s, self._clock = still_wanted, look_every_s, clock
        self._ends_at = clock() + longest_s
        self._looks_at = clock() + look_every_s
        self._came = 0

    def wait_s(self) -> float:
        """Return how long to wait for the network at once, before asking here again.

        Raises:
            OutOfTime: No longer.
            Unwanted: Nobody needs it.
        """
        now = self._clock()
        if now >= self._ends_at:
            limit = f"more than {self._longest_s:g} s"
            raise OutOfTime(f"the endpoint took too long to answer: {limit}")
        if now >= self._looks_at:
            self._looks_at = now + self._look_every_s
            self._still_wanted()
        return max(min(self._ends_at, self._looks_at) - now, _SHORTEST_S)

    def remaining_s(self, most_s: float) -> float:
        """Return how long one step may take that can't be interrupted; raises as above."""
        self.wait_s()
        return max(min(self._ends_at - self._clock(), most_s), _SHORTEST_S)

    def came(self, count: int) -> None:
        """Count bytes as they came over the network.

        Raises:
            UnusableBody: They are more than any answer may have.
        """
        self._came += count
        if self._came > self.most_bytes + _BESIDE_THE_BODY:
            raise self.too_long()

    def too_long(self) -> UnusableBody:
        """Return the fault of an answer beyond the limit."""
        text = f"the endpoint's answer is longer than {self.most_bytes / 1e6:g} MB"
        return UnusableBody(text, retryable=False, status=200)


_WATCH: ContextVar[Watch] = ContextVar("watch over this thread's call")


@contextmanager
def watch_over(watch: Watch) -> Iterator[None]:
    """Let this watch be the thread's while the block runs."""
    token = _WATCH.set(watch)
    try:
        yield
    finally:
        _WATCH.reset(token)


class Transport(AbstractContextManager["Transport"]):
    """Transport of the package's HTTP client (an `httpx2.BaseTransport`).

    Args:
        resolve: From a name to addresses.
        ssl_context: By which certificates are checked.
        proxy_url: Through which everything goes, empty for none. The operator named it, so
            addresses are not checked where there is one.
    """

    def __init__(self, *, resolve: Resolve, ssl_context: ssl.SSLContext, proxy_url: str) -> None:
        import httpcore2

        self._pool = httpcore2.ConnectionPool(
            ssl_context=ssl_context,
            proxy=httpcore2.Proxy(proxy_url) if proxy_url else None,
            max_connections=_MOST_CONNECTIONS,
            network_backend=_Network(resolve, checks=not proxy_url),  # type: ignore[arg-type]
        )

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Return the answer, read to its end.

        Raises:
            WireFault, Unwanted, InvalidDocument: There is none.
        """
        import httpcore2
        import httpx2

        url = request.url
        wire_request = httpcore2.Request(
            method=request.method,
            url=httpcore2.URL(
                scheme=url.raw_scheme, host=url.raw_host, port=url.port, target=url.raw_path
            ),
            headers=request.headers.raw,
            content=request.stream,
        )
        try:
            answer = self._pool.handle_request(wire_request)
            try:
                body = _read_body(answer)
            finally:
                answer.close()
        except (
            *(httpcore2.NetworkError, httpcore2.ProtocolError, httpcore2.ProxyError),
            *(httpcore2.TimeoutException, OSError),
        ) as error:
            # Its text may hold parts of the request.
            cause = error.__cause__ or error.__context__ or error
            reason = getattr(cause, "strerror", None) or type(error).__name__
            raise WireFault(f"the connection failed: {reason}") from None
        headers = [entry for entry in answer.headers if entry[0].lower() not in _OF_THE_TRANSFER]
        return httpx2.Response(answer.status, headers=headers, content=body)

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._pool.close()


def host_and_port(base_url: str) -> str:
    """Return `host:port` as the wire connects to it, empty for what it can't read.

    Read by the package that connects, so that no spelling means one host here and another there.
    """
    import httpx2

    try:
        url = httpx2.URL(base_url)
    except httpx2.InvalidURL:
        return ""
    host = url.raw_host.decode("ascii").lower().removesuffix(".")
    return f"{host}:{url.port or (80 if url.scheme == 'http' else 443)}" if host else ""


# --- Private -----------------------------------------------------------------------------------

_OF_THE_TRANSFER = (b"content-encoding", b"content-length", b"transfer-encoding")


def _read_body(answer: httpcore2.Response) -> bytes:
    """Read a body; empty for an error whose body can't be read: its status says enough.

    Raises:
        OutOfTime, UnusableBody: The body of a success can't be read.
    """
    watch, body = _WATCH.get(), bytearray()
    packing = {name.lower(): value for name, value in answer.headers}.get(
        b"content-encoding", b"identity"
    )
    assert isinstance(answer.stream, Iterable)
    try:
        if packing.lower() != b"identity":
            name = packing.decode("latin-1")[:80]
            raise UnusableBody(f"the endpoint's answer can't be unpacked: {name}", status=200)
        for chunk in answer.stream:
            body += chunk
            if len(body) > watch.most_bytes:
                raise watch.too_long()
    except (OutOfTime, UnusableBody):
        if answer.status < 400:
            raise
        return b""
    return bytes(body)


class _Network:
    """Opens connections (an `httpcore2.NetworkBackend`)."""

    def __init__(self, resolve: Resolve, *, checks: bool) -> None:
        self._resolve, self._checks = resolve, checks

    def connect_tcp(self, host: str, port: int, *_: object, **__: object) -> _Stream:
        """Connect to the first address of the host that takes a connection.

        The name is looked up once: what was checked is what is connected to, and the name stays
        what the certificate is held against.

        Raises:
            InvalidDocument: One of its addresses is forbidden.
            OSError, httpcore2.ConnectError: The name is unknown, or nobody listens.
        """
        import httpcore2

        problem: Exception = OSError(f"{host} has no address")
        for address in self._addresses(host):
            limit_s = _WATCH.get().remaining_s(CONNECT_TIMEOUT_S)
            try:
                backend = httpcore2.SyncBackend()
                return _Stream(backend.connect_tcp(address, port, timeout=limit_s))
            except (httpcore2.ConnectError, httpcore2.ConnectTimeout) as error:
                problem = error
        raise problem

    def _addresses(self, host: str) -> list[str]:
        """Look the name up in a thread of its own, because a look can't be ended."""
        addresses: Future[list[str]] = Future()

        def look() -> None:
            try:
                resolved = resolve_host(host, resolve=self._resolve, checks=self._checks)
                addresses.set_result(resolved)
            except (InvalidDocument, OSError, UnicodeError) as error:
                addresses.set_exception(error)

        Thread(target=look, name="look up a name", daemon=True).start()
        return addresses.result(_WATCH.get().remaining_s(CONNECT_TIMEOUT_S))


class _Stream:
    """A connection that asks the watch of the running call before every wait."""

    def __init__(self, stream: httpcore2.NetworkStream) -> None:
        self._stream = stream
        self.close, self.get_extra_info = stream.close, stream.get_extra_info

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        """Return the next received bytes without waiting for more; empty at the end."""
        import httpcore2

        watch = _WATCH.get()
        while True:
            try:
                data = self._stream.read(min(max_bytes, _AT_ONCE), watch.wait_s())
            except httpcore2.ReadTimeout:
                continue
            watch.came(len(data))
            return data

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        """Send all of it."""
        watch = _WATCH.get()
        limit_s = watch.remaining_s(float("inf"))
        watch.has_written = True
        self._stream.write(buffer, limit_s)

    def start_tls(
        self,
        ssl_context: ssl.SSLContext,
        server_hostname: str | None = None,
        timeout: float | None = None,
    ) -> _Stream:
        """Return the same connection, encrypted."""
        limit_s = _WATCH.get().remaining_s(CONNECT_TIMEOUT_S)
        return _Stream(self._stream.start_tls(ssl_context, server_hostname, limit_s))
