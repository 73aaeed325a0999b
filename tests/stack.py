"""The real product as `manage.py serve` and `manage.py demo` run it, with its private Redis."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from random import SystemRandom
from urllib.error import URLError
from urllib.request import urlopen

from tests.processes import ROOT, Machine, environment_of, wait_until

SMALL_DEMO = ("demo", "--no-serve", "--per-type", "2")


class Home(Machine):
    """A machine that starts its own Redis, as a newcomer's does."""

    def must(self, *arguments: str) -> str:
        ended = self.manage(*arguments, within_s=900.0)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    @classmethod
    def at(cls, folder: Path) -> Home:
        return cls(folder=folder, environment=environment_of(folder))

    def copy(self, folder: Path) -> Home:
        """The same data elsewhere, to be changed by one test."""
        shutil.copytree(self.folder, folder, ignore=shutil.ignore_patterns("*.sock"))
        return Home.at(folder)

    @contextmanager
    def serving(self) -> Iterator[str]:
        """`manage.py serve` on a free port; gives the address and stops all of it in the end."""
        port = free_port()
        log = self.folder / "serve.log"
        with log.open("w") as file:
            process = subprocess.Popen(
                [sys.executable, "manage.py", "serve", "--port", str(port)],
                cwd=ROOT,
                env=self.environment,
                stdout=file,
                stderr=subprocess.STDOUT,
            )
        address = f"http://127.0.0.1:{port}"
        try:
            wait_until(
                lambda: answers(f"{address}/login/") or process.poll() is not None,
                what="the login page answers",
                within_s=240.0,
            )
            assert process.poll() is None, log.read_text()
            yield address
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=120)


def free_port() -> int:
    """A port below those that the system gives to whoever wants any.

    It is listened at seconds later only, and the tests beside this one start many servers.
    """
    while True:
        port = SystemRandom().randrange(10_000, 30_000)
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


def answers(address: str) -> bool:
    try:
        with urlopen(address, timeout=30):
            return True
    except (URLError, OSError):
        return False
