"""Processes of the product on one machine: Redis, workers, the web server, the stand-in model."""

import fcntl
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from urllib.parse import urlsplit

from django.conf import settings
from django.db import DatabaseError, close_old_connections

from arena.errors import ArenaError
from arena.serving.probes import find_redis_server, port_answers, redis_answers, require_free_port
from arena.serving.supervisor import Program
from augment.models import Endpoint

LOCK = "serving.lock"
SHORTEST_GRACE_S, DRAWING_S = 60.0, 30.0
"""A worker that is to stop has the time of a call, and for what is drawn after it."""

WEB_GRACE_S = 35.0
"""Gunicorn itself gives its workers 30 s."""

INTERRUPTED = 130
"""The exit code of what Ctrl-C ended before it was done, as shells have it."""

MANAGE = (sys.executable, str(settings.BASE_DIR / "manage.py"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Web:
    """Address of the pages, and number of processes that serve them."""

    host: str = "127.0.0.1"
    port: int = 8000
    workers: int = 2
    threads: int = 4

    @property
    def address(self) -> str:
        """The address for a browser."""
        shown = "localhost" if self.host in {"127.0.0.1", "0.0.0.0", "::1"} else self.host
        return f"http://{shown}:{self.port}/"


@contextmanager
def hold_alone() -> Iterator[None]:
    """Hold the lock of this folder against other supervisors, unless REDIS_URL is set.

    The operating system releases the lock when this process ends, however it ends.

    Raises:
        ArenaError: Another one holds it.
    """
    if not settings.REDIS_IS_PRIVATE:
        yield
        return
    settings.VAR_DIR.mkdir(parents=True, exist_ok=True)
    with (settings.VAR_DIR / LOCK).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ArenaError(
                f"Scenario Arena runs in this folder already ({lock.name} is held). Stop it first."
            ) from error
        yield


def background(*, concurrency: int) -> list[Program]:
    """Redis where it is the private one, the stand-in models that are missing, and workers.

    Args:
        concurrency: How much is worked on at once, in as many processes as there are cores.

    Raises:
        ArenaError: Redis is needed and not here.
    """
    programs = [_private_redis()] if settings.REDIS_IS_PRIVATE else []
    processes = min(concurrency, os.cpu_count() or 1)
    threads = -(-concurrency // processes)
    workers = [_worker(number + 1, threads) for number in range(processes)]
    return [*programs, *missing_stand_ins(), *workers]


def web_server(web: Web) -> Program:
    """Gunicorn on a port that is free.

    Raises:
        ArenaError: It is not.
    """
    require_free_port(web.host, web.port)
    arguments = (
        *(sys.executable, "-m", "gunicorn", "arena.config.wsgi"),
        *("--bind", f"[{web.host}]:{web.port}" if ":" in web.host else f"{web.host}:{web.port}"),
        *("--worker-class", "arena.serving.web_worker.BufferingWorker"),
        *("--workers", str(web.workers), "--threads", str(web.threads)),
        *("--worker-tmp-dir", str(settings.VAR_DIR)),
        "--no-control-socket",
    )
    is_ready = partial(port_answers, web.host, web.port)
    return Program(name="web", arguments=arguments, is_ready=is_ready, grace_s=WEB_GRACE_S)


def missing_stand_ins() -> list[Program]:
    """Return a server for each simulated endpoint of this computer that nobody serves yet."""
    try:
        simulated = list(Endpoint.objects.filter(is_simulated=True))
    except DatabaseError:  # it may answer the next time
        return []
    finally:
        close_old_connections()
    programs = []
    for endpoint in simulated:
        address = urlsplit(endpoint.base_url)
        host, port = address.hostname, address.port
        if host not in {"localhost", "127.0.0.1"} or port is None or port_answers(host, port):
            continue
        arguments = (*MANAGE, "fake_llm", "--port", str(port))
        is_ready = partial(port_answers, host, port)
        programs.append(Program(name="fake_llm", arguments=arguments, is_ready=is_ready))
    return programs


# --- Private -----------------------------------------------------------------------------------


def _private_redis() -> Program:
    """A Redis on a socket alone; what it holds can be lost, the rows are the truth."""
    arguments = (
        str(find_redis_server()),
        *("--port", "0"),
        *("--unixsocket", str(settings.PRIVATE_REDIS_SOCKET)),
        *("--unixsocketperm", "700"),
        *("--save", ""),
        *("--appendonly", "no"),
        *("--dir", str(settings.VAR_DIR)),
        *("--loglevel", "warning"),
    )
    is_ready = partial(redis_answers, settings.REDIS_URL)
    return Program(name="redis", arguments=arguments, is_ready=is_ready, ready_within_s=15.0)


def _worker(number: int, threads: int) -> Program:
    # Threads for waiting: for models and for the disk. Computing takes a process for each core.
    arguments = (
        *(sys.executable, "-m", "celery", "--app", "arena.config", "--quiet", "worker"),
        *("--hostname", f"worker{number}@%h"),
        *("--pool", "threads", "--concurrency", str(threads)),
        *("--loglevel", settings.LOG_LEVEL.lower()),
        *("--without-gossip", "--without-mingle"),
    )
    # In a container everybody is root; Celery's warning of that says nothing to this user.
    environment = {"PYTHONWARNINGS": "ignore:You're running the worker"}
    return Program(
        name="worker",
        arguments=arguments,
        environment=environment,
        # A worker that is up is subscribed to its remote control.
        is_ready=partial(redis_answers, settings.REDIS_URL, holds="_kombu.binding.celery.pidbox"),
        # A call in flight may take this long; cut off, it would be paid and asked again.
        grace_s=max(SHORTEST_GRACE_S, settings.LLM_TIMEOUT_S) + DRAWING_S,
    )
