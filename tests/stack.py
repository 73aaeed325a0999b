"""The real product as processes: commands and `manage.py serve` in a folder of their own."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Home:
    """A folder with a database, pictures and a private Redis of its own."""

    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        kept = {k: v for k, v in os.environ.items() if k not in {"DATABASE_URL", "REDIS_URL"}}
        return kept | {
            "ARENA_VAR_DIR": str(self.folder / "var"),
            "ARENA_MEDIA_DIR": str(self.folder / "media"),
            "PYTHONUNBUFFERED": "1",
        }

    @property
    def database(self) -> Path:
        return self.folder / "var" / "arena.sqlite3"

    def manage(
        self, *arguments: str, timeout_s: float = 180.0
    ) -> subprocess.CompletedProcess[str]:
        """Run a command to its end; whether it went well is for the caller to say."""
        return subprocess.run(
            [sys.executable, str(ROOT / "manage.py"), *arguments],
            cwd=ROOT,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=timeout_s,
        )

    def must(self, *arguments: str, timeout_s: float = 180.0) -> str:
        """Run a command that has to end well; returns what it printed."""
        finished = self.manage(*arguments, timeout_s=timeout_s)
        assert finished.returncode == 0, finished.stdout + finished.stderr
        return finished.stdout

    def copy(self, folder: Path) -> Home:
        """The same data elsewhere, to be changed by one test."""
        shutil.copytree(self.folder, folder, ignore=shutil.ignore_patterns("*.sock"))
        return Home(folder=folder)

    @contextmanager
    def serving(self, *, within_s: float = 60.0) -> Iterator[str]:
        """`manage.py serve` on a free port; gives the address and stops all of it in the end."""
        port = free_port()
        log = (self.folder / "serve.log").open("w")
        process = subprocess.Popen(
            [sys.executable, str(ROOT / "manage.py"), "serve", "--port", str(port)],
            cwd=ROOT,
            env=self.environment,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        address = f"http://127.0.0.1:{port}"
        try:
            _await(f"{address}/login/", process, self.folder / "serve.log", within_s)
            yield address
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=40)
            log.close()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _await(address: str, process: subprocess.Popen[bytes], log: Path, within_s: float) -> None:
    deadline = time.monotonic() + within_s
    while True:
        assert process.poll() is None, log.read_text()
        assert time.monotonic() < deadline, log.read_text()
        try:
            with urlopen(address, timeout=5):
                return
        except (URLError, OSError):
            time.sleep(0.2)
