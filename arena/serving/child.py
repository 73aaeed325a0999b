"""One child process: started on a leash, its last lines kept, stopped for good."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

KEPT_LINES = 20
POLL_S = 0.05
READER_S = 5.0
"""How long its last lines are waited for; what it started may keep its output open."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """What to run and how to see that it works.

    Attributes:
        name: The word before each of its lines.
        arguments: The command line.
        environment: What it needs beside the environment of the supervisor.
        is_ready: Asked until it says yes; it must not raise.
        is_alive: Asked with its process id every ALIVE_EVERY_S while it runs; on no it is killed
            and started again. It must not raise.
        ready_within_s: How long it may take to come up.
        grace_s: How long it may take to end after SIGTERM.
    """

    name: str
    arguments: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    is_ready: Callable[[], bool]
    is_alive: Callable[[int], bool] = lambda pid: True
    ready_within_s: float = 60.0
    grace_s: float = 10.0


class Child:
    """A running program.

    Args:
        program: What to run.
        say: Gets every line that the program prints.
        environment: What every child of the supervisor has in its environment.
    """

    def __init__(
        self,
        program: Program,
        say: Callable[[str, str], None],
        environment: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self.program = program
        self._last_lines: deque[str] = deque(maxlen=KEPT_LINES)
        self._say = say
        leash = (sys.executable, "-m", "arena.serving.leash", str(os.getpid()), "--")
        # A session of its own: Ctrl-C reaches the supervisor alone, which then stops its children
        # in order; and the whole group can be killed when one of them does not listen.
        self._process = subprocess.Popen(
            (*leash, *program.arguments),
            env={**os.environ, "PYTHONUNBUFFERED": "1", **environment, **program.environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        self._reader = threading.Thread(
            target=self._read, name=f"{program.name} lines", daemon=True
        )
        self._reader.start()

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """None while it runs."""
        return self._process.poll()

    def last_words(self) -> list[str]:
        """Its last lines; of one that has ended everything that it still had to say."""
        if self.exit_code is not None:
            self._reader.join(timeout=READER_S)
        return list(self._last_lines)

    def ask_to_stop(self) -> None:
        """Send SIGTERM, if it still runs."""
        if self.exit_code is None:
            self._process.terminate()

    def stop(self, *, is_hurried: Callable[[], bool] = lambda: False) -> None:
        """End it and whatever it started: SIGTERM, after the grace SIGKILL to the whole group.

        Args:
            is_hurried: Asked all the while; once it says yes, the grace is over.
        """
        self.ask_to_stop()
        limit = time.monotonic() + self.program.grace_s
        while self.exit_code is None and not is_hurried():
            if time.monotonic() > limit:
                self._say(self.program.name, f"did not end within {self.program.grace_s:.0f} s")
                break
            time.sleep(POLL_S)
        self.kill()

    def kill(self) -> None:
        """End it and whatever it started at once."""
        with contextlib.suppress(ProcessLookupError):  # nobody of the group is left: as wanted
            os.killpg(self.pid, signal.SIGKILL)
        self._process.wait()
        self._reader.join(timeout=READER_S)

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                self._last_lines.append(line.rstrip())
                self._say(self.program.name, line.rstrip())
