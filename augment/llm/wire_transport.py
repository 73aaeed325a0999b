"""HTTP for the `openai` package with bounded answers: read whole, within a limit once unpacked."""

from __future__ import annotations

import select
import socket
import ssl
import threading
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any

from augment.errors import InvalidDocument, Unwanted
from augment.llm.addresses import Resolve, addresses_of

if TYPE_CHECKING:
    import httpcore2
    import httpx2


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


CONNECT_TIMEOUT_S = 10.0
_AT_ONCE = 64 * 1024


class Network:
    """Opens connections.

    Args:
        watches: Over the calls that connections are opened and used for.
        resolve: From a name to addresses.
        checks: Whether forbidden addresses are refused; not where all goes to the proxy that the
            operator named.
    """

    def __init__(self, watches: Watches, *, resolve: Resolve, checks: bool = True) -> None:
        self._watches = watches
        self._resolve = resolve
        self._checks = checks

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[Any] | None = None,
    ) -> Stream:
        """A connection to the first address of the host that takes one.

        The name is looked up once: what was checked is what is connected to, and the name stays
        what the certificate is held against.

        Raises:
            InvalidDocument: One of its addresses is forbidden.
            OSError: The name is unknown, or nobody listens.
        """
        watch = self._watches.now()
        problem: OSError = OSError(f"{host} has no address")
        for address in self._addresses(host, watch):
            try:
                sock = socket.create_connection((address, port), _connect_s(watch))
            except OSError as error:
                problem = error
            else:
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return Stream(sock, self._watches)
        raise problem

    def connect_unix_socket(self, *_: object, **__: object) -> Stream:
        """Never: endpoints are at addresses.

        Raises:
            OSError: Always.
        """
        raise OSError("no endpoint is at a socket of this computer")

    def sleep(self, seconds: float) -> None:
        """Never called: nothing is tried twice here.

        Raises:
            OSError: Always.
        """
        raise OSError("nothing is tried twice here")

    def _addresses(self, host: str, watch: Watch) -> list[str]:
        """Looked up in a thread of its own, because a look can't be ended."""
        outcomes: list[list[str] | InvalidDocument | OSError | UnicodeError] = []

        def look() -> None:
            try:
                outcomes.append(addresses_of(host, resolve=self._resolve, checks=self._checks))
            except (InvalidDocument, OSError, UnicodeError) as error:
                outcomes.append(error)

        thread = threading.Thread(target=look, name="look up a name", daemon=True)
        thread.start()
        thread.join(_connect_s(watch))
        if not outcomes:
            raise TimeoutError(f"{host} could not be looked up in time")
        if isinstance(outcomes[0], Exception):
            raise outcomes[0]
        return outcomes[0]


class Stream:
    """A connection that asks the watch of the running call before every wait."""

    def __init__(self, sock: socket.socket, watches: Watches) -> None:
        import httpcore2

        self._socket = sock
        self._watches = watches
        # Whoever sends goes on to read after this error: the server may have answered early.
        self._write_error = httpcore2.WriteError

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        """What came, as soon as anything has; nothing at the end.

        Raises:
            OutOfTime, TooLong, Unwanted: The watch ends the call.
            OSError: The connection broke.
        """
        watch = self._watches.now()
        while True:
            self._socket.settimeout(watch.wait_s())
            try:
                data = self._socket.recv(min(max_bytes, _AT_ONCE))
            except TimeoutError:
                continue
            watch.came(len(data))
            return data

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        """Send all of it.

        Raises:
            OutOfTime, Unwanted: The watch ends the call.
            httpcore2.WriteError: The connection broke.
        """
        watch, rest = self._watches.now(), memoryview(buffer)
        while rest:
            self._socket.settimeout(watch.wait_s())
            try:
                sent = self._socket.send(rest)
            except TimeoutError:
                continue
            except OSError as error:
                raise self._write_error(str(error)) from error
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
    ) -> Stream:
        """The same connection, encrypted; the time limit is that of the whole handshake.

        Raises:
            OSError: The other side is not who it should be, or broke off.
        """
        try:
            self._socket.settimeout(_connect_s(self._watches.now()))
            wrapped = ssl_context.wrap_socket(self._socket, server_hostname=server_hostname)
        except (OSError, ValueError):
            self.close()
            raise
        return Stream(wrapped, self._watches)

    def get_extra_info(self, info: str) -> Any:
        """What the transport asks about a connection."""
        match info:
            case "ssl_object" if isinstance(self._socket, ssl.SSLSocket):
                return self._socket
            case "socket":
                return self._socket
            case "client_addr":
                return self._socket.getsockname()
            case "server_addr":
                return self._socket.getpeername()
            case "is_readable":
                return _is_readable(self._socket)
        return None


# --- Private -----------------------------------------------------------------------------------


def _connect_s(watch: Watch) -> float:
    """How long a step on the way to a connection may take."""
    watch.wait_s()
    return min(watch.left_s(), CONNECT_TIMEOUT_S)


def _is_readable(sock: socket.socket) -> bool:
    """Whether an idle connection has something to say: it was closed, mostly."""
    if sock.fileno() < 0:
        return True
    poll = select.poll()
    poll.register(sock, select.POLLIN)
    return bool(poll.poll(0))


ACCEPTED = "gzip, deflate"
"""What is asked for; both can be unpacked up to a limit."""

_GZIP, _ZLIB, _BARE = 31, 15, -15
_UNPACKED_AWAY = (b"content-encoding", b"content-length", b"transfer-encoding")
_MOST_CONNECTIONS = 100


class BadPacking(Exception):
    """A body is packed in a way that nobody asked for, or is broken."""


class Transport(AbstractContextManager["Transport"]):
    """What the package's HTTP client sends requests by (an `httpx2.BaseTransport`).

    Args:
        network: Opens the connections.
        watches: Over the calls.
        ssl_context: By which certificates are checked.
        proxy_url: Through which everything goes, empty for none.
    """

    def __init__(
        self, network: Network, watches: Watches, *, ssl_context: ssl.SSLContext, proxy_url: str
    ) -> None:
        import httpcore2

        self._watches = watches
        self._pool = httpcore2.ConnectionPool(
            ssl_context=ssl_context,
            proxy=httpcore2.Proxy(proxy_url) if proxy_url else None,
            max_connections=_MOST_CONNECTIONS,
            network_backend=network,  # type: ignore[arg-type]
        )

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """The answer, read to its end.

        Raises:
            httpx2.TransportError: There is none; what led to it is its cause. The package knows
                errors of this kind alone.
        """
        import httpcore2
        import httpx2

        try:
            return self._answered(request)
        except (
            *(OSError, OutOfTime, TooLong, BadPacking, Unwanted, InvalidDocument),
            *(httpcore2.NetworkError, httpcore2.ProtocolError, httpcore2.ProxyError),
            httpcore2.TimeoutException,
        ) as error:
            raise httpx2.TransportError(type(error).__name__) from error

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._pool.close()

    def _answered(self, request: httpx2.Request) -> httpx2.Response:
        import httpcore2
        import httpx2

        asked = httpcore2.Request(
            method=request.method,
            url=httpcore2.URL(
                scheme=request.url.raw_scheme,
                host=request.url.raw_host,
                port=request.url.port,
                target=request.url.raw_path,
            ),
            headers=request.headers.raw,
            content=request.stream,
        )
        answer = self._pool.handle_request(asked)
        try:
            body = self._body(answer)
        finally:
            answer.close()
        left = [
            (name, value) for name, value in answer.headers if name.lower() not in _UNPACKED_AWAY
        ]
        return httpx2.Response(answer.status, headers=left, content=body)

    def _body(self, answer: httpcore2.Response) -> bytes:
        watch = self._watches.now()
        packings = [
            word
            for name, value in answer.headers
            if name.lower() == b"content-encoding"
            for word in value.decode("latin-1").lower().replace(" ", "").split(",")
            if word not in ("", "identity")
        ]
        try:
            assert isinstance(answer.stream, Iterable)
            return unpack_body(answer.stream, packings, most_bytes=watch.most_bytes)
        except TooLong:
            if answer.status < 400:
                raise watch.too_long() from None
        except (OutOfTime, BadPacking):
            if answer.status < 400:
                raise
        # Its status says enough of an error.
        watch.ended_by = None
        return b""


def unpack_body(chunks: Iterable[bytes], packings: list[str], *, most_bytes: int) -> bytes:
    """A body that is never held in more than so many bytes, whatever it was packed from.

    Raises:
        TooLong: It has more.
        BadPacking: It is packed otherwise than by gzip or deflate, more than once, or broken.
    """
    if packings and packings not in (["gzip"], ["x-gzip"], ["deflate"]):
        raise BadPacking(", ".join(packings)[:80])
    unpack = _Unpacker(packings[0]) if packings else None
    body = bytearray()
    for chunk in chunks:
        while chunk:
            room = most_bytes + 1 - len(body)
            if unpack is None:
                body += chunk[:room]
                chunk = b""
            else:
                part, chunk = unpack.some(chunk, room)
                body += part
            if len(body) > most_bytes:
                raise TooLong
    if unpack is not None and not unpack.is_over:
        raise BadPacking(f"{packings[0]}, cut off")
    return bytes(body)


class _Unpacker:
    def __init__(self, packing: str) -> None:
        self._packing = packing
        self._packed = zlib.decompressobj(_ZLIB if packing == "deflate" else _GZIP)
        self._has_begun = False

    @property
    def is_over(self) -> bool:
        return self._packed.eof

    def some(self, chunk: bytes, room: int) -> tuple[bytes, bytes]:
        """At most that much of what the chunk holds, and what is left of the chunk."""
        if self._packed.eof:
            return b"", b""
        try:
            part = self._packed.decompress(chunk, room)
        except zlib.error as error:
            if self._has_begun or self._packing != "deflate":
                raise BadPacking(f"{self._packing}, broken") from error
            # Some servers send deflate without the wrapping that its name stands for.
            self._packed = zlib.decompressobj(_BARE)
            self._has_begun = True
            return self.some(chunk, room)
        self._has_begun = True
        return part, self._packed.unconsumed_tail
