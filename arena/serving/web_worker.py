"""A gunicorn worker whose threads meet only whole requests and never wait for a reader.

Gunicorn looks after the processes. In each of them one thread of Waitress reads requests and sends
answers, all connections at once, so that somebody who sends a byte a second or reads as slowly
holds a connection and no thread. Threads of the worker get requests that are complete, header and
body, and hand over answers that are kept for their reader.
"""

import os
import time
from typing import Any

from django.conf import settings
from gunicorn.workers.base import Worker
from waitress.buffers import OverflowableBuffer
from waitress.channel import HTTPChannel
from waitress.parser import HTTPRequestParser
from waitress.server import create_server
from waitress.wasyncore import loop

from arena.serving.leash import die_with

REQUEST_WITHIN_S = 30.0
"""So long a request may take to come in, and a second more for each BYTES_A_SECOND of it."""

BYTES_A_SECOND = 1_000
IDLE_S = 60
"""So long a connection without a request is kept."""

CONNECTIONS = 250
"""So many a process holds: each takes up to three of the 1024 files that are usual."""

FORM_BYTES = 4_000_000
"""What a form may hold beside a file of ARENA_UPLOAD_MB."""

CUT = "X_BODY_CUT"
"""The header that says that a body was larger: all of it came in, its beginning is handed on."""

LARGEST_BODY = 8 * 1024 * 1024 * 1024
"""A longer one is not even read to its end, so its sender may see no answer."""

LARGEST_HEADER = 64 * 1024
KEPT_ANSWER = 1024 * 1024 * 1024
"""So many bytes of one answer wait for a slow reader, beyond the first of them on disk."""


class CutBuffer(OverflowableBuffer):  # type: ignore[misc] # Waitress has no types
    """A buffer that drops what is beyond the largest upload and its form."""

    is_cut = False

    def append(self, data: bytes) -> None:
        """Keep what there is room for."""
        room = settings.UPLOAD_MB * 1_000_000 + FORM_BYTES - len(self)
        self.is_cut |= len(data) > room
        super().append(data[:room])


class WholeRequest(HTTPRequestParser):  # type: ignore[misc]
    """A request whose body is read to its end even if it is too large.

    Closing the connection on a sender would reset it before the answer is read.
    """

    def received(self, data: bytes) -> int:
        """Take what came in; Waitress's own reading."""
        consumed, body = int(super().received(data)), self.body_rcv
        if body is not None and not self.body_bytes_received:
            body.buf = CutBuffer(self.adj.inbuf_overflow)
        elif self.completed and body is not None and body.buf.is_cut:
            self.headers |= {CUT: "1", "CONTENT_LENGTH": str(len(body))}
        return consumed


class Connection(HTTPChannel):  # type: ignore[misc]
    """A connection that knows when its request began, and how much of it came in."""

    parser_class = WholeRequest
    began_at = 0.0
    came_in = 0

    def received(self, data: bytes) -> bool:
        """Take what came in; Waitress's own reading."""
        if self.request is None:
            self.began_at, self.came_in = time.monotonic(), 0
        self.came_in += len(data)
        return bool(super().received(data))

    def is_late(self, now: float) -> bool:
        """Return whether the request that has begun should have been complete by now."""
        allowed_s = REQUEST_WITHIN_S + self.came_in / BYTES_A_SECOND
        return self.request is not None and now - self.began_at > allowed_s

    @property
    def is_idle(self) -> bool:
        """True if nothing can be done for it before more of a request comes in."""
        return not self.requests and not self.total_outbufs_len


class BufferingWorker(Worker):  # type: ignore[misc] # gunicorn has no types
    """Waitress on gunicorn's sockets, with as many threads as gunicorn's setting says."""

    def init_process(self) -> None:
        """End with gunicorn, even where it is killed before the application is loaded."""
        die_with(self.ppid)
        super().init_process()

    def run(self) -> None:
        """Serve until gunicorn says stop, or is gone."""
        self._map: dict[int, Any] = {}
        server = create_server(
            self.wsgi,
            map=self._map,
            sockets=[listening.sock for listening in self.sockets],
            threads=self.cfg.threads,
            backlog=self.cfg.backlog,
            connection_limit=CONNECTIONS,
            channel_timeout=IDLE_S,
            cleanup_interval=5,
            max_request_header_size=LARGEST_HEADER,
            max_request_body_size=LARGEST_BODY,
            outbuf_high_watermark=KEPT_ANSWER,
            asyncore_use_poll=True,
            log_socket_errors=False,
            # Which proxies are believed is for the settings to say.
            clear_untrusted_proxy_headers=False,
            ident=None,
        )
        listeners = [entry for entry in self._map.values() if hasattr(entry, "channel_class")]
        for listener in listeners:
            listener.channel_class = Connection
        while self.alive and self.ppid == os.getppid():
            self._turn()
        for listener in listeners:
            listener.accepting = False
            listener.socket.close()
            self._map.pop(listener._fileno, None)
        limit = time.monotonic() + self.cfg.graceful_timeout
        while time.monotonic() < limit and not all(
            connection.is_idle for connection in self._connections()
        ):
            self._turn()
        server.task_dispatcher.shutdown(timeout=1)

    def _turn(self) -> None:
        self.notify()
        loop(timeout=1.0, use_poll=True, map=self._map, count=1)
        now = time.monotonic()
        for connection in self._connections():
            if connection.is_late(now):
                connection.will_close = True

    def _connections(self) -> list[Connection]:
        return [entry for entry in list(self._map.values()) if isinstance(entry, Connection)]
