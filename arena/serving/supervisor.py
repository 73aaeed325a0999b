"""Supervision of several programs: started in order, restarted when they crash, stopped together.

A program that keeps crashing is restarted after growing delays while the others go on: a broken
worker does not take the web server down.
"""

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import FrameType

from arena.errors import ArenaError

KEPT_LINES = 20
POLL_S = 0.1
TURNS = 10
"""So often is polled before it is asked what else is missing."""

READER_S = 5.0
"""How long its last lines are waited for; what it started may keep its output open."""

STEADY_S = 60.0
"""A program that ran this long before it crashed is restarted at once."""

LONGEST_WAIT_S = 60.0
CRASHES_ALLOWED = 3
"""More crashes in a row than this count as a crash loop."""


class ChildFailed(ArenaError):
    """A program did not come up or keeps crashing; the text ends with its last lines."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """Command of a process, and the sign that it works.

    Attributes:
        name: The word before each of its lines.
        arguments: The command line.
        environment: What it needs beside the environment of the supervisor.
        is_ready: Asked until it says yes; it must not raise.
        ready_within_s: How long it may take to come up.
        grace_s: How long it may take to end after SIGTERM.
    """

    name: str
    arguments: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    is_ready: Callable[[], bool]
    ready_within_s: float = 60.0
    grace_s: float = 10.0


class Child:
    """A program and the process that runs it, or ran it until it crashed.

    Attributes:
        crashes: Crashes in a row, each soon after a start.
        due_at: When it is restarted, in monotonic seconds; None while it runs.
    """

    def __init__(self, program: Program, say: Callable[[str, str], None]) -> None:
        self.program = program
        self.crashes = 0
        self.due_at: float | None = None
        self._say = say
        self._last_lines: deque[str] = deque(maxlen=KEPT_LINES)
        self.start()

    def start(self) -> None:
        """Run the program in a session of its own.

        Ctrl-C reaches the supervisor alone, which then stops its children in order; and the whole
        group can be killed when one of them does not listen.
        """
        leash = (sys.executable, "-m", "arena.serving.leash", str(os.getpid()), "--")
        self.process = subprocess.Popen(
            (*leash, *self.program.arguments),
            env={**os.environ, "PYTHONUNBUFFERED": "1", **self.program.environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        self._started_at, self.due_at = time.monotonic(), None
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def exit_code(self) -> int | None:
        """Exit code, None while it runs."""
        return self.process.poll()

    def stop(self, is_hurried: Callable[[], bool]) -> None:
        """Send SIGTERM, and when the grace is over or hurried SIGKILL to the whole group."""
        self.process.terminate()
        limit = time.monotonic() + self.program.grace_s
        while self.exit_code is None and not is_hurried() and time.monotonic() < limit:
            time.sleep(POLL_S)
        self._kill()

    def schedule_restart(self) -> None:
        """Count the crash; the next start waits 0, 1, 2, 4, ... s after so many in a row."""
        was_steady = time.monotonic() - self._started_at >= STEADY_S
        self.crashes = 1 if was_steady else self.crashes + 1
        wait_s = min(2.0 ** (self.crashes - 2), LONGEST_WAIT_S) if self.crashes > 1 else 0.0
        self.due_at = time.monotonic() + wait_s
        text = f"ended with exit code {self.exit_code}; starting it again in {wait_s:.0f} s"
        self._say(self.program.name, text)
        self._kill()

    def failure(self, what: str) -> ChildFailed:
        """Return an error that ends with the program's last lines."""
        if self.exit_code is not None:
            self._reader.join(timeout=READER_S)
        lines = "\n".join(f"    {line}" for line in self._last_lines)
        return ChildFailed(f"{self.program.name} {what}. Its last lines:\n{lines}")

    def _kill(self) -> None:
        with suppress(ProcessLookupError):  # nobody of the group is left: as wanted
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self._reader.join(timeout=READER_S)

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as lines:
            for line in lines:
                self._last_lines.append(line.rstrip())
                self._say(self.program.name, line.rstrip())


class Supervisor:
    """Start programs in order, restart what crashes, and stop all in reverse order.

    Args:
        programs: What to run; each is ready before the next one starts.
        say: Gets (name, line) for every line of a child and for what the supervisor does.
    """

    def __init__(self, programs: Sequence[Program], say: Callable[[str, str], None]) -> None:
        self.children: list[Child] = []
        self._programs = programs
        self._say = say
        # A plain counter, polled: a signal handler may not take the lock of what it interrupts.
        self._stops_asked = 0

    @property
    def is_stopping(self) -> bool:
        """True if a stop was requested."""
        return self._stops_asked > 0

    def ask_to_stop(self) -> None:
        """Make `watch` return; asked again, `stop` waits for no grace."""
        self._stops_asked += 1

    def start(self) -> None:
        """Start every program and wait until each is ready.

        Raises:
            ChildFailed: A program did not start; those before it are stopped.
        """
        for program in self._programs:
            if self.is_stopping:
                return
            self.children.append(Child(program, self._say))
            try:
                self._await_ready(self.children[-1])
            except ChildFailed:
                self.stop()
                raise

    def watch(self, missing: Callable[[], Sequence[Program]] = tuple) -> None:
        """Supervise until a stop is requested.

        Args:
            missing: Asked now and then; what it names and does not run is started as well.
        """
        for turn in itertools.count():
            if self.is_stopping:
                return
            self.check()
            running = {child.program.arguments for child in self.children}
            for program in () if turn % TURNS else missing():
                if program.arguments not in running:
                    self.children.append(Child(program, self._say))
            time.sleep(POLL_S)

    def check(self) -> None:
        """Restart crashed programs that are due."""
        for child in self.children:
            if child.due_at is None and child.exit_code is not None:
                child.schedule_restart()
            elif child.due_at is not None and time.monotonic() >= child.due_at:
                child.start()

    def insist_on_steadiness(self) -> None:
        """Raise if a program keeps crashing; for callers that wait for the programs' results.

        Raises:
            ChildFailed: A program keeps crashing; nothing is stopped.
        """
        for child in self.children:
            if child.crashes > CRASHES_ALLOWED:
                raise child.failure(f"crashed {child.crashes} times in a row")

    def stop(self) -> None:
        """Stop every child, the last started first."""
        self._stops_asked = max(self._stops_asked, 1)
        while self.children:
            child = self.children.pop()
            self._say(child.program.name, "ends what is under way (Ctrl-C ends it at once)")
            child.stop(is_hurried=lambda: self._stops_asked > 1)

    @contextmanager
    def signals(self) -> Iterator[None]:
        """Request a stop on Ctrl-C, SIGTERM and SIGHUP."""

        def handle(_number: int, _frame: FrameType | None) -> None:
            self.ask_to_stop()

        handled = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        before = {number: signal.signal(number, handle) for number in handled}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _await_ready(self, child: Child) -> None:
        deadline = time.monotonic() + child.program.ready_within_s
        while not self.is_stopping and not child.program.is_ready():
            if child.exit_code is not None:
                raise child.failure(f"ended with exit code {child.exit_code}")
            if time.monotonic() > deadline:
                raise child.failure(f"is not ready after {child.program.ready_within_s:.0f} s")
            time.sleep(POLL_S)
