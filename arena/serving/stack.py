"""What the product needs on one machine: Redis, a worker, the web server, the stand-in model."""

import fcntl
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import redis
from django.conf import settings
from django.db import DatabaseError, connection

from arena.errors import ArenaError
from arena.serving.ledger import end_orphans
from arena.serving.probes import find_redis_server, port_answers, redis_answers, require_free_port
from arena.serving.supervisor import Program
from augment.models import Endpoint
from augment.services.running.workers import is_silent

LOCK = "serving.lock"


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


class AlreadyRunning(ArenaError):
    """Another supervisor runs in the same folder."""


@contextmanager
def hold_alone(say: Callable[[str], None]) -> Iterator[None]:
    """Hold the lock of this folder against other supervisors, unless REDIS_URL is set.

    The operating system releases the lock when this process ends, however it ends. Processes that
    a killed supervisor left behind are ended.

    Args:
        say: Gets a line where anything is ended.

    Raises:
        AlreadyRunning: Another one holds it, or left its Redis behind.
    """
    if not settings.REDIS_IS_PRIVATE:
        end_orphans(settings.VAR_DIR, say)
        yield
        return
    folder: Path = settings.VAR_DIR
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise AlreadyRunning(
                f"Scenario Arena runs or starts in this folder already ({folder / LOCK} is "
                "held). Stop it first."
            ) from error
        end_orphans(folder, say)
        if redis_answers(settings.PRIVATE_REDIS_SOCKET):
            raise AlreadyRunning(
                "Scenario Arena runs in this folder already (its private Redis answers on "
                f"{settings.PRIVATE_REDIS_SOCKET}). Stop it first."
            )
        yield


SHORTEST_GRACE_S, DRAWING_S = 60.0, 30.0
"""A worker that is to stop has the time of a call, and for what is drawn after it."""

HUNG_AFTER = 3
"""Times `ARENA_STALE_AFTER_S`: a database that is locked for a while silences a sound worker."""

WEB_GRACE_S = 35.0
"""Gunicorn itself gives its workers 30 s."""

SERVED_AT = "served-at"
"""The file under var/ that holds the address of the running server."""

MANAGE = (sys.executable, str(settings.BASE_DIR / "manage.py"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Web:
    """Where the pages are served, by how many processes."""

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
def remembered_address(web: Web) -> Iterator[None]:
    """Keep in a file where the pages are served, for as long as they are."""
    file = settings.VAR_DIR / SERVED_AT
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(web.address, encoding="utf-8")
    try:
        yield
    finally:
        file.unlink(missing_ok=True)


def served_address() -> str | None:
    """Return where this installation's pages are served now, None where nobody does."""
    with suppress(OSError):
        address = (settings.VAR_DIR / SERVED_AT).read_text(encoding="utf-8")
        parts = urlsplit(address)
        if port_answers(parts.hostname or "localhost", parts.port or 80):
            return address
    return None


def background(*, concurrency: int) -> list[Program]:
    """Redis where it is the private one, the stand-in models that are missing, and a worker.

    Raises:
        NoRedisServer: It is needed and not here.
    """
    programs: list[Program] = []
    if settings.REDIS_IS_PRIVATE:
        settings.VAR_DIR.mkdir(parents=True, exist_ok=True)
        programs.append(private_redis(settings.PRIVATE_REDIS_SOCKET))
    programs.extend(_missing_stand_ins())
    programs.append(_worker(concurrency))
    return programs


def web_server(web: Web) -> Program:
    """Gunicorn on a port that is free.

    Raises:
        PortTaken: It is not.
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
    return Program(
        name="web",
        arguments=arguments,
        is_ready=lambda: port_answers(web.host, web.port),
        grace_s=WEB_GRACE_S,
    )


def _worker(concurrency: int) -> Program:
    # Threads: the work is waiting for models and drawing in Pillow, which both let go of the
    # interpreter; one process starts faster, and nothing of it can be left behind.
    arguments = (
        *(sys.executable, "-m", "celery", "--app", "arena.config", "--quiet", "worker"),
        *("--pool", "threads", "--concurrency", str(concurrency)),
        *("--loglevel", settings.LOG_LEVEL.lower()),
        *("--without-gossip", "--without-mingle"),
    )
    # In a container everybody is root; Celery's warning of that says nothing to this user.
    environment = {"PYTHONWARNINGS": "ignore:You're running the worker"}
    return Program(
        name="worker",
        arguments=arguments,
        environment=environment,
        is_ready=_worker_listens,
        is_alive=_worker_is_heard,
        # A call in flight may take this long; cut off, it would be paid and asked again.
        grace_s=max(SHORTEST_GRACE_S, settings.LLM_TIMEOUT_S) + DRAWING_S,
    )


def _worker_listens() -> bool:
    """Whether a worker is subscribed to its remote control, which it does when it is up."""
    client = _broker()
    try:
        return bool(client.exists("_kombu.binding.celery.pidbox"))
    except (redis.RedisError, OSError):
        return False
    finally:
        client.close()


def _worker_is_heard(pid: int) -> bool:
    """Return whether the worker of this process gave a sign of life lately; True if unknown."""
    try:
        return not is_silent(pid=pid, for_s=HUNG_AFTER * settings.STALE_AFTER_S)
    except DatabaseError:
        return True
    finally:
        connection.close()


def _broker() -> redis.Redis:
    url = str(settings.REDIS_URL)
    if url.startswith("redis+socket://"):
        return redis.Redis(unix_socket_path=url.removeprefix("redis+socket://").split("?")[0])
    return redis.Redis.from_url(url)


def _missing_stand_ins() -> list[Program]:
    """One server for each simulated endpoint of this computer that nobody serves yet."""
    programs = []
    for endpoint in Endpoint.objects.filter(is_simulated=True):
        address = urlsplit(endpoint.base_url)
        host, port = address.hostname, address.port
        if host not in {"localhost", "127.0.0.1"} or port is None or port_answers(host, port):
            continue
        programs.append(
            Program(
                name="fake_llm",
                arguments=(*MANAGE, "fake_llm", "--port", str(port)),
                is_ready=lambda host=host, port=port: port_answers(host, port),  # type: ignore[misc]
            )
        )
    return programs
