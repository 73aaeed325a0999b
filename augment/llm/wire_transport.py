"""HTTP for the `openai` package that no server can hold up, swell or redirect.

A call ends with its time, with too much in its answer, or when nobody wants it any more. A
connection leads to the address that was checked. An answer is read whole, within a limit once
unpacked.
"""

from __future__ import annotations

import select
import socket
import ssl
import threading
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from augment.errors import InvalidDocument, Unwanted
from augment.llm.addresses import Resolve, addresses_of

if TYPE_CHECKING:
    import httpcore2
    import httpx2

LOOK_EVERY_S = 1.0
"""So often somebody who waits for an answer asks whether it is still wanted."""
CONNECT_TIMEOUT_S = 10.0
ACCEPTED = "gzip"
"""What is asked for; it can be unpacked up to a limit."""

# What may come beside a body: status, headers, the sizes of chunks. One header block of more
# than 100 kB is refused by the HTTP parser anyway.
_BESIDE_THE_BODY = 256 * 1024
_AT_ONCE = 64 * 1024
_SHORTEST_S = 0.001
_GZIP = 31
_MOST_CONNECTIONS = 100
_UNPACKED_AWAY = (b"content-encoding", b"content-length", b"transfer-encoding")


class OutOfTime(Exception):
    """The call has had its time."""


class TooLong(Exception):
    """More came than an answer may have."""


class BadPacking(Exception):
    """A body is packed in a way that nobody asked for, or is broken."""


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
        """Return how long to wait for the network at once, before asking here again.

        Raises:
            OutOfTime: No longer.
            Unwanted: Nobody needs it.
        """
        now = self._clock()
        if now >= self._ends_at:
            self.ended_by = OutOfTime()
            raise self.ended_by
        if now >= self._looks_at:
            self._looks_at = now + self._look_every_s
            try:
                self._still_wanted()
            except Unwanted as why:
                self.ended_by = why
                raise
        return max(min(self._ends_at, self._looks_at) - now, _SHORTEST_S)

    def connect_s(self) -> float:
        """Return how long a step on the way to a connection may take; raises as above."""
        self.wait_s()
        return max(min(self._ends_at - self._clock(), CONNECT_TIMEOUT_S), _SHORTEST_S)

    def came(self, count: int) -> None:
        """Count bytes as they came over the network.

        Raises:
            TooLong: They are more than any answer may have.
        """
        self._came += count
        if self._came > self.most_bytes + _BESIDE_THE_BODY:
            self.ended_by = TooLong()
            raise self.ended_by


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
    """What the package's HTTP client sends requests by (an `httpx2.BaseTransport`).

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
            httpx2.TransportError: There is none; what led to it is its cause. The package knows
                errors of this kind alone.
        """
        import httpcore2
        import httpx2

        url = request.url
        asked = httpcore2.Request(
            method=request.method,
            url=httpcore2.URL(
                scheme=url.raw_scheme, host=url.raw_host, port=url.port, target=url.raw_path
            ),
            headers=request.headers.raw,
            content=request.stream,
        )
        try:
            answer = self._pool.handle_request(asked)
            try:
                body = _body_of(answer)
            finally:
                answer.close()
        except (
            *(OSError, OutOfTime, TooLong, BadPacking, Unwanted, InvalidDocument),
            *(httpcore2.NetworkError, httpcore2.ProtocolError, httpcore2.ProxyError),
            httpcore2.TimeoutException,
        ) as error:
            raise httpx2.TransportError(type(error).__name__) from error
        headers = [entry for entry in answer.headers if entry[0].lower() not in _UNPACKED_AWAY]
        return httpx2.Response(answer.status, headers=headers, content=body)

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._pool.close()


# Private


def _body_of(answer: httpcore2.Response) -> bytes:
    """Read a body, unpacked; empty for an error whose body can't be read: its status says enough.

    Raises:
        TooLong, OutOfTime, BadPacking: The body of a success can't be read.
    """
    watch = _WATCH.get()
    packings = [
        word
        for name, value in answer.headers
        if name.lower() == b"content-encoding"
        for word in value.decode("latin-1").lower().replace(" ", "").split(",")
        if word not in ("", "identity")
    ]
    assert isinstance(answer.stream, Iterable)
    try:
        return _unpack(answer.stream, packings, watch.most_bytes)
    except (TooLong, OutOfTime, BadPacking) as fault:
        watch.ended_by = None if isinstance(fault, BadPacking) else fault
        if answer.status < 400:
            raise
    watch.ended_by = None
    return b""


def _unpack(chunks: Iterable[bytes], packings: list[str], most_bytes: int) -> bytes:
    """Return a body; never is more than so many bytes held, whatever it was packed from."""
    if packings and packings not in (["gzip"], ["x-gzip"]):
        raise BadPacking(", ".join(packings)[:80])
    unpacker = zlib.decompressobj(_GZIP) if packings else None
    body = bytearray()
    for chunk in chunks:
        while chunk:
            room = most_bytes + 1 - len(body)
            if unpacker is None:
                part, chunk = chunk[:room], b""
            else:
                try:
                    part = unpacker.decompress(chunk, room)
                except zlib.error as error:
                    raise BadPacking(f"{packings[0]}, broken") from error
                chunk = unpacker.unconsumed_tail
            body += part
            if len(body) > most_bytes:
                raise TooLong
    if unpacker is not None and not unpacker.eof:
        raise BadPacking(f"{packings[0]}, cut off")
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
            OSError: The name is unknown, or nobody listens.
        """
        problem: OSError = OSError(f"{host} has no address")
        for address in self._addresses(host):
            try:
                sock = socket.create_connection((address, port), _WATCH.get().connect_s())
            except OSError as error:
                problem = error
            else:
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return _Stream(sock)
        raise problem

    def _addresses(self, host: str) -> list[str]:
        """Look the name up in a thread of its own, because a look can't be ended."""
        outcomes: list[list[str] | InvalidDocument | OSError | UnicodeError] = []

        def look() -> None:
            try:
                outcomes.append(addresses_of(host, resolve=self._resolve, checks=self._checks))
            except (InvalidDocument, OSError, UnicodeError) as error:
                outcomes.append(error)

        thread = threading.Thread(target=look, name="look up a name", daemon=True)
        thread.start()
        thread.join(_WATCH.get().connect_s())
        if not outcomes:
            raise TimeoutError(f"{host} could not be looked up in time")
        if isinstance(outcomes[0], Exception):
            raise outcomes[0]
        return outcomes[0]


class _Stream:
    """A connection that asks the watch of the running call before every wait."""

    def __init__(self, sock: socket.socket) -> None:
        self._socket = sock

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        """Return what came, as soon as anything has; nothing at the end."""
        watch = _WATCH.get()
        while True:
            self._socket.settimeout(watch.wait_s())
            try:
                data = self._socket.recv(min(max_bytes, _AT_ONCE))
            except TimeoutError:
                continue
            watch.came(len(data))
            return data

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        """Send all of it."""
        import httpcore2

        watch, rest = _WATCH.get(), memoryview(buffer)
        while rest:
            self._socket.settimeout(watch.wait_s())
            try:
                sent = self._socket.send(rest)
            except TimeoutError:
                continue
            except OSError as error:
                # After this error the answer is read: the server may have answered early.
                raise httpcore2.WriteError(str(error)) from error
            watch.has_written = True
            rest = rest[sent:]

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def start_tls(
        self,
        ssl_context: ssl.SSLContext,
        server_hostname: str | None = None,
        timeout: float | None = None,
    ) -> _Stream:
        """Return the same connection, encrypted."""
        try:
            self._socket.settimeout(_WATCH.get().connect_s())
            return _Stream(ssl_context.wrap_socket(self._socket, server_hostname=server_hostname))
        except (OSError, ValueError):
            self.close()
            raise

    def get_extra_info(self, info: str) -> Any:
        """Return what the pool asks about a connection."""
        if info == "ssl_object" and isinstance(self._socket, ssl.SSLSocket):
            return self._socket
        if info == "is_readable":
            # An idle connection that has something to say was closed, mostly.
            if self._socket.fileno() < 0:
                return True
            poll = select.poll()
            poll.register(self._socket, select.POLLIN)
            return bool(poll.poll(0))
        return None
