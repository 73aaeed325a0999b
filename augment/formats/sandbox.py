"""A stranger's file is read by a process of its own, with limits that the system enforces.

In: the name of a module that ends in `serve(...)`, and a request. Out: its answer. Both are plain
JSON, so that a file which takes that process over gets no further. The process is a fresh
interpreter (a worker has threads, so it can't be forked) without our settings and keys in its
environment; a timer of the system ends it should whoever asked die.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

from augment.errors import InvalidDocument

_ROOT = Path(__file__).resolve().parents[2]
_STACK_BYTES = 8 << 20
_FILE_BYTES = 2_000_000_000
"""Of one file that it writes: as much as a zip may unpack to."""
_ANSWER_BYTES = 64 << 20
_NO_MEMORY = 12
"""The exit status of a process that got no more memory (ENOMEM)."""
_PASSED_ON = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "LANG", "TMPDIR")
_SINGLE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_FRUGAL = {"ARROW_DEFAULT_MEMORY_POOL": "system", "MALLOC_ARENA_MAX": "2"}
"""Otherwise a gigabyte of addresses is reserved at start."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessLimits:
    """Limits of a process: some four times the use of the largest recordings here.

    Attributes:
        cpu_s: Seconds of computing, of all its threads together.
        deadline_s: Seconds by the clock; other work on the machine counts.
        memory_bytes: Addresses, with what Python and its libraries take (about 150 MB).
    """

    cpu_s: int = 8
    deadline_s: int = 60
    memory_bytes: int = 1 << 30


USUAL_LIMITS = ProcessLimits()


def run(
    module: str, request: dict[str, Any], *, name: str, limits: ProcessLimits = USUAL_LIMITS
) -> Any:
    """Return a module's answer to a request, from a process of its own.

    Args:
        module: Calls `serve` when it is run.
        request: Plain JSON.
        name: Of the file, for the reason.
        limits: Of the process.

    Raises:
        InvalidDocument: The module refused the file, or broke a limit over it, or crashed.
        RuntimeError: The module has a fault of its own; the text ends with its traceback.
    """
    with (
        tempfile.TemporaryFile() as request_file,
        tempfile.TemporaryFile() as answer,
        tempfile.TemporaryFile() as log,
    ):
        request_file.write(json.dumps(request).encode())
        request_file.seek(0)
        status = _wait(module, limits, request_file, answer, log)
        if status == 0:
            return _answer_in(answer, name)
        reason = _reason(status, limits)
        if reason:
            raise InvalidDocument("file", [(name, reason)])
        log.seek(max(0, log.seek(0, os.SEEK_END) - 4_000))
        raise RuntimeError(
            f"{module} ended with status {status}: {log.read().decode(errors='replace')}"
        )


def serve(operation: Callable[[dict[str, Any]], object]) -> None:
    """Answer the request at the standard input, within the limits that the arguments name."""
    _limit_this_process(ProcessLimits(**json.loads(sys.argv[1])))
    try:
        answer: dict[str, object] = {"answer": operation(json.load(sys.stdin))}
        text = json.dumps(answer, allow_nan=False)
    except InvalidDocument as fault:
        problems = [[str(path), str(text)] for path, text in fault.problems]
        text = json.dumps({"what": str(fault.what), "problems": problems})
    except RecursionError:
        text = json.dumps({"what": "file", "problems": [["", "is nested too deeply"]]})
    except MemoryError:
        os._exit(_NO_MEMORY)
    sys.stdout.write(text)
    sys.stdout.flush()
    os._exit(0)  # whatever the file made of the memory is not taken apart


# Private


def _wait(
    module: str, limits: ProcessLimits, request_file: IO[bytes], answer: IO[bytes], log: IO[bytes]
) -> int:
    """Run the module and return its status, negative for a signal."""
    environment = {key: os.environ[key] for key in _PASSED_ON if key in os.environ}
    try:
        done = subprocess.run(
            [sys.executable, "-m", module, json.dumps(asdict(limits))],
            stdin=request_file,
            stdout=answer,
            stderr=log,
            cwd=_ROOT,
            env=environment | _SINGLE_THREAD | _FRUGAL,
            timeout=limits.deadline_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -signal.SIGALRM
    return done.returncode


def _limit_this_process(limits: ProcessLimits) -> None:
    signal.alarm(limits.deadline_s + 1)  # nobody waits any more, or whoever waited is dead
    for kind, most in (
        (resource.RLIMIT_CPU, limits.cpu_s),
        (resource.RLIMIT_AS, limits.memory_bytes),
        (resource.RLIMIT_STACK, _STACK_BYTES),
        (resource.RLIMIT_FSIZE, _FILE_BYTES),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        allowed = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (allowed, hard))


def _reason(status: int, limits: ProcessLimits) -> str:
    """Why the process ended, empty where it has a fault of its own."""
    reasons = {
        _NO_MEMORY: f"takes more than {limits.memory_bytes >> 20} MB of memory to read",
        -signal.SIGXCPU: f"takes more than {limits.cpu_s} s of computing to read",
        -signal.SIGALRM: f"was not read within {limits.deadline_s} s",
        -signal.SIGKILL: "was not read: the system ended its reader, most likely for memory",
    }
    if status < 0 and status not in reasons:
        return f"crashes its reader ({signal.Signals(-status).name})"
    return reasons.get(status, "")


def _answer_in(answer: IO[bytes], name: str) -> Any:
    if answer.seek(0, os.SEEK_END) > _ANSWER_BYTES:
        text = f"holds more than {_ANSWER_BYTES >> 20} MB of scene"
        raise InvalidDocument("file", [(name, text)])
    answer.seek(0)
    reply = json.load(answer)
    if "answer" in reply:
        return reply["answer"]
    raise InvalidDocument(reply["what"], [(path, text) for path, text in reply["problems"]])
