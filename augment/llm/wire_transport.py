"""HTTP for the `openai` package with bounded answers: read whole, within a limit once unpacked."""

from __future__ import annotations

import ssl
import zlib
from collections.abc import Iterable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from augment.errors import InvalidDocument, Unwanted
from augment.llm.wire_network import Network
from augment.llm.wire_watch import OutOfTime, TooLong, Watches

if TYPE_CHECKING:
    import httpcore2
    import httpx2

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
