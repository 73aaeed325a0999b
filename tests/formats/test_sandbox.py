"""A process with limits: it answers, refuses, or is ended with the reason."""

import os
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from augment.errors import InvalidDocument
from augment.formats import sandbox
from augment.formats.sandbox import ProcessLimits

TIGHT = ProcessLimits(cpu_s=2, deadline_s=30, memory_bytes=1 << 29)


def ask(what: str, limits: ProcessLimits = TIGHT) -> Any:
    return sandbox.run("tests.formats.sandboxed", {"do": what}, name="a.log", limits=limits)


def test_what_breaks_a_limit_is_refused_with_the_reason() -> None:
    for what, reason in (
        ("refuse", r"This log can't be read: row 3: is no number"),
        ("allocate", r"a\.log: takes more than 512 MB of memory to read"),
        ("fill", r"a\.log: takes more than 512 MB of memory to read"),
        ("nest", r"is nested too deeply"),
        ("compute", r"a\.log: takes more than 2 s of computing to read"),
        ("compute in C", r"a\.log: takes more than 2 s of computing to read"),
        ("crash", r"a\.log: crashes its reader \(SIGSEGV\)"),
        ("talk", r"a\.log: holds more than 64 MB"),
    ):
        with pytest.raises(InvalidDocument, match=reason):
            ask(what)


def test_who_only_waits_is_ended_by_the_clock() -> None:
    with pytest.raises(InvalidDocument, match=r"a\.log: was not read within 2 s"):
        ask("sleep", ProcessLimits(deadline_s=2))


def test_a_fault_of_our_own_is_none_of_the_file() -> None:
    with pytest.raises(RuntimeError, match="LookupError: a fault of our own"):
        ask("fail")


def test_no_secret_is_in_its_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARENA_SECRET_KEY", "hidden")
    assert "ARENA_SECRET_KEY" not in ask("environment")


def test_another_thread_goes_on_meanwhile() -> None:
    """Long computing in C holds the lock of its interpreter, and that of nobody else."""

    def ask_much() -> None:
        with pytest.raises(InvalidDocument):
            ask("compute in C")

    thread = Thread(target=ask_much)
    thread.start()
    assert ask("nothing") is None
    assert thread.is_alive()
    thread.join()


def test_it_ends_itself_where_whoever_asked_was_killed() -> None:
    program = (
        "from augment.formats.sandbox import ProcessLimits, run\n"
        "limits = ProcessLimits(deadline_s=5)\n"
        "run('tests.formats.sandboxed', {'do': 'sleep'}, name='', limits=limits)"
    )
    asking = subprocess.Popen([sys.executable, "-c", program])
    children = Path(f"/proc/{asking.pid}/task/{asking.pid}/children")
    while not (pids := children.read_text().split()):
        time.sleep(0.05)
    time.sleep(1.0)
    asking.kill()
    asking.wait()
    until = time.monotonic() + 30
    while Path(f"/proc/{pids[0]}/cmdline").exists() and _is_alive(int(pids[0])):
        assert time.monotonic() < until
        time.sleep(0.2)


def _is_alive(pid: int) -> bool:
    try:
        return " Z " not in Path(f"/proc/{pid}/stat").read_text() and os.getpgid(pid) == pid
    except (ProcessLookupError, FileNotFoundError):
        return False
