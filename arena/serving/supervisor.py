"""Supervision of several programs: started and stopped together, restarted when they crash.

A program that keeps crashing is restarted after growing delays while the others go on: a broken
worker does not take the web server down.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType, MappingProxyType

from arena.errors import ArenaError
from arena.serving.ledger import Ledger

KEPT_LINES = 20
STOP_POLL_S = 0.05
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
            time.sleep(STOP_POLL_S)
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


POLL_S = 0.1
LONG_GRACE_S = 30.0
"""A program with a grace period of at least this is announced when it is stopped."""

STEADY_S = 60.0
"""A program that ran this long before it crashed is restarted at once."""

LONGEST_WAIT_S = 60.0
ALIVE_EVERY_S = 5.0
CRASHES_ALLOWED = 3
"""More crashes in a row than this count as a crash loop."""


class ChildFailed(ArenaError):
    """A program did not come up or keeps crashing; the text ends with its last lines."""


@dataclass(slots=True)
class Place:
    """The state of one supervised program.

    Attributes:
        child: The process that runs it, or ran it until it crashed.
        started_at: When that process was started, in seconds of the supervisor's clock.
        crashes: Crashes in a row, each soon after a start.
        due_at: When it is restarted; None while it runs.
        asked_at: When its liveness was last checked.
    """

    child: Child
    started_at: float
    crashes: int = 0
    due_at: float | None = None
    asked_at: float = 0.0


def wait_s(crashes: int) -> float:
    """Return the delay before a restart after this many crashes in a row: 0, 1, 2, 4, ... 60 s."""
    return min(2.0 ** min(crashes - 2, 10), LONGEST_WAIT_S) if crashes > 1 else 0.0


class Supervisor:
    """Start programs in order, restart what crashes or hangs, and stop all in reverse order.

    Args:
        programs: What to run; each is ready before the next one starts.
        say: Gets (name, line) for every line of a child and for what the supervisor does.
        ledger: Where the children are written down, None for nowhere.
        clock: Seconds that never run back.
    """

    def __init__(
        self,
        programs: Sequence[Program],
        say: Callable[[str, str], None],
        *,
        ledger: Ledger | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._programs = programs
        self._say = say
        self._clock = clock
        self._ledger = ledger
        self._places: list[Place] = []
        # A plain flag, polled: a signal handler may not take the lock of what it interrupts.
        self._stopping = False
        self._interrupts = 0

    def start(self) -> None:
        """Start every program and wait until each is ready.

        Raises:
            ChildFailed: A program did not start; those before it are stopped.
        """
        for program in self._programs:
            if self._stopping:
                return
            self._places.append(Place(self._child(program), started_at=self._clock()))
            try:
                self._await_ready(self._places[-1].child)
            except ChildFailed:
                self.stop()
                raise

    def watch(self) -> None:
        """Supervise until a stop is requested."""
        while not self._stopping:
            self.check()
            time.sleep(POLL_S)

    def check(self) -> None:
        """Restart crashed programs that are due, and kill those that hang."""
        for place in self._places:
            if self._stopping:
                return
            if place.due_at is not None:
                if self._clock() >= place.due_at:
                    self._restart(place)
            elif place.child.exit_code is not None:
                self._handle_crash(place)
            elif self._clock() - place.asked_at >= ALIVE_EVERY_S:
                place.asked_at = self._clock()
                if not place.child.program.is_alive(place.child.pid):
                    self._say(place.child.program.name, "hangs; killing it")
                    place.child.kill()

    def insist_on_steadiness(self) -> None:
        """Raise if a program keeps crashing; for callers that wait for the programs' results.

        Raises:
            ChildFailed: A program keeps crashing; nothing is stopped.
        """
        for place in self._places:
            if place.crashes > CRASHES_ALLOWED:
                raise self._failure(place.child, f"crashed {place.crashes} times in a row")

    @property
    def is_stopping(self) -> bool:
        """Whether a stop was requested."""
        return self._stopping

    def ask_to_stop(self) -> None:
        """Make `watch` return; safe to call from a signal handler."""
        self._stopping = True

    def stop(self) -> None:
        """Stop every child, the last started first."""
        self._stopping = True
        while self._places:
            child = self._places[-1].child
            if child.program.grace_s >= LONG_GRACE_S and child.exit_code is None:
                self._say(
                    child.program.name,
                    f"ends what is under way, at most {child.program.grace_s:.0f} s "
                    "(Ctrl-C once more ends it at once)",
                )
            child.stop(is_hurried=lambda: self._interrupts > 1)
            self._places.pop()
        if self._ledger is not None:
            self._ledger.close()

    @contextmanager
    def signals(self) -> Iterator[None]:
        """Request a stop on Ctrl-C, SIGTERM and SIGHUP; a second one skips the grace."""
        handled = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

        def handle(_number: int, _frame: FrameType | None) -> None:
            self._interrupts += 1
            self.ask_to_stop()

        before = {number: signal.signal(number, handle) for number in handled}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _await_ready(self, child: Child) -> None:
        deadline = self._clock() + child.program.ready_within_s
        while not self._stopping:
            if child.exit_code is not None:
                raise self._failure(child, f"ended with exit code {child.exit_code}")
            if child.program.is_ready():
                return
            if self._clock() > deadline:
                waited = f"{child.program.ready_within_s:.0f} s"
                raise self._failure(child, f"is not ready after {waited}")
            time.sleep(POLL_S)

    def _handle_crash(self, place: Place) -> None:
        """Count a crash and schedule the restart."""
        name, code = place.child.program.name, place.child.exit_code
        was_steady = self._clock() - place.started_at >= STEADY_S
        place.crashes = 1 if was_steady else place.crashes + 1
        self._schedule_restart(place, f"ended with exit code {code}")
        place.child.kill()
        if place.crashes == CRASHES_ALLOWED + 1:
            self._say(name, "keeps crashing; everything else goes on without it")

    def _schedule_restart(self, place: Place, what: str) -> None:
        after_s = wait_s(place.crashes)
        place.due_at = self._clock() + after_s
        when = f"in {after_s:.0f} s" if after_s else "now"
        self._say(place.child.program.name, f"{what}; starting it again {when}")

    def _restart(self, place: Place) -> None:
        try:
            place.child = self._child(place.child.program)
        except OSError as error:  # no memory, no process left: the next try may have them
            place.crashes += 1
            self._schedule_restart(place, f"could not be started ({error})")
            return
        place.started_at, place.due_at = self._clock(), None

    def _child(self, program: Program) -> Child:
        if self._ledger is None:
            return Child(program, self._say)
        child = Child(program, self._say, self._ledger.environment)
        self._ledger.note(program.name, child.pid)
        return child

    @staticmethod
    def _failure(child: Child, what: str) -> ChildFailed:
        lines = (
            "\n".join(f"    {line}" for line in child.last_words()) or "    (it printed nothing)"
        )
        return ChildFailed(f"{child.program.name} {what}. Its last lines:\n{lines}")
