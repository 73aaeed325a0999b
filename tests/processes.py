"""Real processes for journeys: a Redis, Celery workers, commands, and a model that waits."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import MappingProxyType
from typing import Any

from arena.serving.probes import find_redis_server, redis_answers

ROOT = Path(__file__).resolve().parents[1]
SOCKET = "redis.sock"
MIGRATED = "migrated.sqlite3"
"""What is kept of the empty database, in the temporary folder of a run."""
LONG_AGO = "2026-01-01 00:00:00"


def wait_until(is_so: Callable[[], bool], *, what: str, within_s: float = 120.0) -> None:
    limit = time.monotonic() + within_s
    while not is_so():
        assert time.monotonic() < limit, f"not within {within_s:g} s: {what}"
        time.sleep(0.05)


class Process:
    """A process in a group of its own, what it says in a file."""

    def __init__(self, arguments: list[str], *, environment: dict[str, str], log: Path) -> None:
        self.log = log
        with log.open("ab") as file:
            self._started = subprocess.Popen(
                arguments,
                cwd=ROOT,
                env=environment,
                stdout=file,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def said(self) -> str:
        return self.log.read_text(errors="replace")

    def is_alive(self) -> bool:
        return self._started.poll() is None

    def kill(self) -> None:
        """As `kill -9` does, the whole group."""
        self._signal(signal.SIGKILL)
        self._started.wait(60)

    def stop(self) -> None:
        self._signal(signal.SIGTERM)
        try:
            self._started.wait(150)
        except subprocess.TimeoutExpired:
            self.kill()

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._started.pid, number)


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """A folder with everything that one installation needs, and the processes on it."""

    folder: Path
    environment: dict[str, str]

    @property
    def socket(self) -> Path:
        return self.folder / SOCKET

    @property
    def media(self) -> Path:
        return self.folder / "media"

    def manage(self, *arguments: str, within_s: float = 300.0) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "manage.py", *arguments],
            cwd=ROOT,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=within_s,
            check=False,
        )

    def must(self, *arguments: str) -> str:
        ended = self.manage(*arguments)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    def must_all(self, *commands: tuple[str, ...]) -> str:
        """Several commands one after the other, in one process: its start takes the longest."""
        calls = "".join(f"call_command(*{list(command)!r});" for command in commands)
        code = f"from django.core.management import call_command;{calls}"
        return self.must("shell", "--verbosity", "0", "-c", code)

    @property
    def database(self) -> Path:
        return self.folder / "db.sqlite3"

    def rows(self, query: str) -> list[tuple[Any, ...]]:
        connection = sqlite3.connect(self.database, timeout=60, isolation_level=None)
        try:
            return connection.execute(query).fetchall()
        finally:
            connection.close()

    def age(self, column: str, *, state: str) -> None:
        """Let what rows in a state remember of the clock be long ago, so that no test waits."""
        self.rows(
            f"UPDATE augment_augmentation SET {column} = '{LONG_AGO}' WHERE state = '{state}'"
        )

    def redis(self) -> Process:
        arguments = [str(find_redis_server()), "--port", "0", "--unixsocket", str(self.socket)]
        arguments += ["--save", "", "--appendonly", "no", "--dir", str(self.folder)]
        started = Process(arguments, environment=self.environment, log=self.folder / "redis.log")
        wait_until(lambda: redis_answers(f"unix://{self.socket}"), what="Redis answers")
        return started

    def worker(self, *, pool: str = "threads", concurrency: int = 2) -> Process:
        arguments = [sys.executable, "-m", "celery", "-A", "arena.config", "worker"]
        arguments += ["--pool", pool, "-c", str(concurrency), "--loglevel", "info"]
        log = self.folder / f"worker-{time.monotonic_ns()}.log"
        started = Process(arguments, environment=self.environment, log=log)
        wait_until(
            lambda: " ready." in started.said() or not started.is_alive(), what="the worker is up"
        )
        assert started.is_alive(), started.said()
        return started


EAGER = {
    "ARENA_HEARTBEAT_S": "1",
    "ARENA_STALE_AFTER_S": "120",  # a busy machine is no dead one; see Machine.age
    "ARENA_RECOVER_EVERY_S": "1",
    "PYTHONWARNINGS": "ignore",
}


def environment_of(folder: Path) -> dict[str, str]:
    """What an installation in a folder is told, without any Redis and anybody's key."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name != "REDIS_URL" and not name.startswith("OPENAI_")
    }
    return kept | {
        "ARENA_VAR_DIR": str(folder / "var"),
        "ARENA_MEDIA_DIR": str(folder / "media"),
        "DATABASE_URL": f"sqlite:///{folder / 'db.sqlite3'}",
    }


@contextmanager
def machine(
    changes: Mapping[str, str] = MappingProxyType({}), *, database: Path | None = None
) -> Iterator[Machine]:
    """An installation with a copy of an SQLite file, else of an empty one; nothing runs yet.

    The folder is a short one of its own, because a socket's path has 108 bytes.
    """
    folder = Path(tempfile.mkdtemp(prefix="arena-"))
    redis = {"REDIS_URL": f"redis+socket://{folder / SOCKET}", **EAGER}
    made = Machine(folder=folder, environment=environment_of(folder) | redis | dict(changes))
    try:
        if database is None:
            made.must("migrate", "--verbosity", "0")
        else:
            copy_database(database, made.database)
        yield made
    finally:
        shutil.rmtree(folder)


def copy_database(source: Path, to: Path) -> None:
    """An SQLite file as it is now, with what is still in its log."""
    with closing(sqlite3.connect(source)) as given, closing(sqlite3.connect(to)) as made:
        given.backup(made)


class WaitingModel:
    """An OpenAI-compatible server in this process that answers when it is allowed to.

    Attributes:
        base_url: For an endpoint.
        gate: Answers go out while it is set.
        asked: How many requests came in.
    """

    def __init__(self, answer: str) -> None:
        self.start_anew()
        self._counting = threading.Lock()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler(answer))
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self.base_url = f"http://127.0.0.1:{self._server.server_port}/v1"

    def __enter__(self) -> WaitingModel:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.gate.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def start_anew(self) -> None:
        """As if nobody had asked yet, the gate closed."""
        self.gate = threading.Event()
        self.asked = 0

    def _count(self) -> None:
        with self._counting:
            self.asked += 1

    def _handler(self, answer: str) -> type[BaseHTTPRequestHandler]:
        outside = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                outside._count()
                outside.gate.wait(600)
                body = json.dumps(_completion(request["model"], answer)).encode()
                # Who asked may have been killed meanwhile.
                with suppress(BrokenPipeError, ConnectionResetError):
                    self.send_response(200)
                    self.send_header("Content-Type", "application/json")
                    self.send_header("Content-Length", str(len(body)))
                    self.end_headers()
                    self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:
                pass

        return Handler


def _completion(model: str, answer: str) -> dict[str, object]:
    return {
        "id": "answer-1",
        "object": "chat.completion",
        "created": 0,
        "model": model,
        "choices": [
            {
                "index": 0,
                "finish_reason": "stop",
                "message": {"role": "assistant", "content": answer},
            }
        ],
        "usage": {"prompt_tokens": 2900, "completion_tokens": 120, "total_tokens": 3020},
    }
