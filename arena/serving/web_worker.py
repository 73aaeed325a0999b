"""A gunicorn worker whose threads meet only whole requests and never wait for a reader.

Gunicorn looks after the processes. In each of them one thread of Waitress reads requests and sends
answers, all connections at once, so that somebody who sends a byte a second or reads as slowly
holds a connection and no thread. Threads of the worker get requests that are complete, header and
body, and hand over answers that are kept for their reader.
"""

import logging
import os
import resource
import time
from typing import Any

from gunicorn.workers.base import Worker
from waitress.channel import HTTPChannel
from waitress.server import create_server
from waitress.wasyncore import loop

REQUEST_WITHIN_S = 30.0
"""So long a request may take to come in, and a second more for each BYTES_A_SECOND of it."""

BYTES_A_SECOND = 1_000
IDLE_S = 60
"""So long a connection without a request is kept."""

CONNECTIONS = 500
"""So many a process holds; then those that wait the longest for their request make room."""

LARGEST_BODY = 64 * 1024 * 1024
LARGEST_HEADER = 64 * 1024
KEPT_ANSWER = 1024 * 1024 * 1024
"""So many bytes of one answer wait for a slow reader, beyond the first of them on disk."""

_ROOM = 50
_LOOK_EVERY_S = 1.0
_FILES_EACH = 3
_FILES_BESIDE = 200


class Connection(HTTPChannel):  # type: ignore[misc] # Waitress has no types
    """A connection that knows since when it waits, and for how much of a request."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.waits_since = time.monotonic()
        self.came_in = 0

    def received(self, data: bytes) -> bool:
        """Take what came in; Waitress's own reading."""
        if self.request is None:
            self.waits_since, self.came_in = time.monotonic(), 0
        self.came_in += len(data)
        return bool(super().received(data))

    def service(self) -> None:
        """Answer one request; from then on the next one is waited for."""
        super().service()
        self.waits_since, self.came_in = time.monotonic(), 0

    @property
    def is_waiting(self) -> bool:
        """Whether nothing is to be done for it before more of a request comes in."""
        return not self.requests and not self.total_outbufs_len

    def is_late(self, now: float) -> bool:
        """Whether the request that has begun should have been complete by now."""
        allowed_s = REQUEST_WITHIN_S + self.came_in / BYTES_A_SECOND
        return self.request is not None and now - self.waits_since > allowed_s


class BufferingWorker(Worker):  # type: ignore[misc] # gunicorn has no types
    """Waitress on gunicorn's sockets, with as many threads as gunicorn's setting says."""

    def handle_exit(self, sig: int, frame: Any) -> None:
        """Begin to end: what has come in is answered, nothing new is taken."""
        super().handle_exit(sig, frame)
        server = getattr(self, "_server", None)
        if server is not None:
            server.trigger.pull_trigger()

    def run(self) -> None:
        """Serve until gunicorn says stop, or is gone."""
        _raise_file_limit()
        # Its threads take turns at a queue on purpose: that it has an entry is no news.
        logging.getLogger("waitress.queue").setLevel(logging.ERROR)
        self._map: dict[int, Any] = {}
        self._server = create_server(
            self.wsgi,
            map=self._map,
            sockets=[listening.sock for listening in self.sockets],
            threads=self.cfg.threads,
            backlog=self.cfg.backlog,
            connection_limit=CONNECTIONS + _ROOM,
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
        for listening in self._listening():
            listening.channel_class = Connection
        next_look = 0.0
        while self.alive and self.ppid == os.getppid():
            self._turn()
            if time.monotonic() >= next_look:
                make_room(self._connections(), now=time.monotonic())
                next_look = time.monotonic() + _LOOK_EVERY_S
        self._finish()

    def _turn(self) -> None:
        self.notify()
        loop(timeout=1.0, use_poll=True, map=self._map, count=1)

    def _finish(self) -> None:
        """Answer what came in before the end, within gunicorn's time for that."""
        for listening in self._listening():
            listening.accepting = False
            listening.socket.close()
            self._map.pop(listening._fileno, None)
        limit = time.monotonic() + self.cfg.graceful_timeout
        while time.monotonic() < limit and not all(
            connection.is_waiting for connection in self._connections()
        ):
            self._turn()
        self._server.task_dispatcher.shutdown(timeout=1)

    def _listening(self) -> list[Any]:
        return [found for found in list(self._map.values()) if hasattr(found, "channel_class")]

    def _connections(self) -> list[Connection]:
        return [found for found in list(self._map.values()) if isinstance(found, Connection)]


def make_room(connections: list[Connection], *, now: float) -> None:
    """Close whose request is late, and of too many those that wait the longest.

    Args:
        connections: All of a process.
        now: Seconds of the clock that `waits_since` is of.
    """
    for connection in connections:
        if connection.is_late(now):
            connection.will_close = True
    waiting = sorted(
        (found for found in connections if found.is_waiting), key=lambda found: found.waits_since
    )
    for connection in waiting[: max(0, len(connections) - CONNECTIONS)]:
        connection.will_close = True


def _raise_file_limit() -> None:
    """A connection takes up to three files: itself, a long request and a long answer."""
    wanted = _FILES_EACH * (CONNECTIONS + _ROOM) + _FILES_BESIDE
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        highest = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (highest, hard))
