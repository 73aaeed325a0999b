"""Several programs as one: all up or none, all down together, a crashed one is started again."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from arena.errors import ArenaError
from arena.serving.child import Child, Program

POLL_S = 0.1
CRASHES_ALLOWED = 3
WITHIN_S = 60.0


class ChildFailed(ArenaError):
    """A program did not come up or keeps crashing; the text ends with its last lines."""


class Supervisor:
    """Runs programs in the given order and stops them in the opposite one.

    Args:
        programs: What to run; each is ready before the next one starts.
        say: Gets (name, line) for every line of a child and for what the supervisor does.
        clock: Seconds that never run back.
    """

    def __init__(
        self,
        programs: Sequence[Program],
        say: Callable[[str, str], None],
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._programs = programs
        self._say = say
        self._clock = clock
        self._children: list[Child] = []
        self._crashes: dict[str, list[float]] = {}
        # A plain flag, polled: a signal handler may not take the lock of what it interrupts.
        self._stopping = False
        self._interrupts = 0

    def start(self) -> None:
        """Bring every program up.

        Raises:
            ChildFailed: One did not come up; those before it are stopped again.
        """
        for program in self._programs:
            if self._stopping:
                return
            self._children.append(Child(program, self._say))
            try:
                self._await_ready(self._children[-1])
            except ChildFailed:
                self.stop()
                raise

    def watch(self) -> None:
        """Return when somebody asks to stop.

        Raises:
            ChildFailed: A program crashed too often; everything is stopped already.
        """
        while not self._stopping:
            self.check()
            time.sleep(POLL_S)

    def check(self) -> None:
        """Start again what has crashed.

        Raises:
            ChildFailed: A program crashed too often; everything is stopped already.
        """
        for place, child in enumerate(self._children):
            if child.exit_code is not None and not self._stopping:
                self._children[place] = self._start_again(child)

    @property
    def is_stopping(self) -> bool:
        """Whether somebody asked to stop."""
        return self._stopping

    def ask_to_stop(self) -> None:
        """Let `watch` return; safe to call from a signal handler."""
        self._stopping = True

    def stop(self) -> None:
        """Stop every child, the last started first."""
        self._stopping = True
        while self._children:
            self._children.pop().stop(at_once=self._interrupts > 1)

    @contextmanager
    def signals(self) -> Iterator[None]:
        """Turn Ctrl-C, SIGTERM and SIGHUP into a request to stop; a second one means at once."""
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

    def _start_again(self, child: Child) -> Child:
        name, now = child.program.name, self._clock()
        crashes = [at for at in self._crashes.get(name, []) if now - at < WITHIN_S] + [now]
        self._crashes[name] = crashes
        if len(crashes) > CRASHES_ALLOWED:
            failure = self._failure(
                child,
                f"crashed {len(crashes)} times within {WITHIN_S:.0f} s; everything is stopped",
            )
            self.stop()
            raise failure
        self._say(name, f"ended with exit code {child.exit_code}; starting it again")
        child.stop(at_once=True)
        return Child(child.program, self._say)

    @staticmethod
    def _failure(child: Child, what: str) -> ChildFailed:
        lines = (
            "\n".join(f"    {line}" for line in child.last_words()) or "    (it printed nothing)"
        )
        return ChildFailed(f"{child.program.name} {what}. Its last lines:\n{lines}")
