"""A module that does in a sandbox what it is asked to."""

import os
import signal
import time
from collections.abc import Callable
from typing import Any

from augment.errors import InvalidDocument
from augment.formats.sandbox import serve


def _refuse() -> object:
    raise InvalidDocument("log", [("row 3", "is no number")])


def _fail() -> object:
    raise LookupError("a fault of our own")


def _nest() -> object:
    held: list[object] = []
    for _ in range(100_000):
        held = [held]
    return held


def _compute() -> object:
    while True:
        hash("x")


DEEDS: dict[str, Callable[[], object]] = {
    "nothing": lambda: None,
    "environment": lambda: sorted(os.environ),
    "refuse": _refuse,
    "fail": _fail,
    "allocate": lambda: len(bytearray(1 << 40)),
    "fill": lambda: len([bytearray(1 << 20) for _ in range(1 << 20)]),
    "nest": _nest,
    "compute": _compute,
    "compute in C": lambda: pow(3, 1 << 40),
    "sleep": lambda: time.sleep(600),
    "crash": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "talk": lambda: "x" * (65 << 20),
}


def _do(request: dict[str, Any]) -> object:
    return DEEDS[request["do"]]()


if __name__ == "__main__":
    serve(_do)
