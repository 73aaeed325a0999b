"""Connections that lead to the address that was checked, and end with their call's time.

They are what the package's transport builds upon (`httpcore2.NetworkBackend`, `NetworkStream`).
"""

from __future__ import annotations

import select
import socket
import ssl
import threading
from collections.abc import Iterable
from typing import Any

from augment.errors import InvalidDocument
from augment.llm.addresses import Resolve, addresses_of
from augment.llm.wire_watch import Watch, Watches

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
