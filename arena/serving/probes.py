"""Is it up? Questions to ports and sockets of this computer."""

from __future__ import annotations

import socket
from pathlib import Path

import redis
from redis.backoff import NoBackoff
from redis.retry import Retry

from arena.errors import ArenaError

HIGHEST_PORT = 65_535


class PortTaken(ArenaError):
    """The product can't listen where it should: mostly somebody else does already."""


def require_free_port(host: str, port: int) -> None:
    """Return if a server can listen there.

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
    """Whether somebody accepts connections there."""
    try:
        with socket.create_connection((host, port), timeout=1.0):
            return True
    except OSError:
        return False


def redis_answers(socket_path: Path) -> bool:
    """Whether a Redis answers on that socket."""
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
