"""The list of processes that a supervisor has started, so that the next one can end orphans.

After `kill -9` the programs of a supervisor end with it on Linux, but not what they started
themselves (web workers that hold the port), and elsewhere nothing does. Only that is ended which
is ours beyond doubt: a process with the number and the start that were written down, or one that
carries the secret of that supervisor in its environment.
"""

import json
import os
import secrets
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

from arena.exports.files import write_whole

MARK = "ARENA_SERVED_BY"
"""The environment variable with the secret; whatever a child starts inherits it."""

SAME_START_S = 2.0
"""The system reckons a start from the wall clock, which may be put right in between."""

TERM_S, KILL_S = 5.0, 10.0


class Ledger:
    """The list of one supervisor, on disk before and as long as anything of it runs.

    Args:
        folder: Where it is kept.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / f"serving-{os.getpid()}.json"
        self._secret = secrets.token_hex(16)
        self._children: list[dict[str, Any]] = []
        folder.mkdir(parents=True, exist_ok=True)
        self._write()

    @property
    def environment(self) -> Mapping[str, str]:
        """What every child needs in its environment."""
        return {MARK: self._secret}

    def note(self, name: str, pid: int) -> None:
        """Write down a child that was just started."""
        with suppress(psutil.NoSuchProcess):  # gone already: nothing to end later
            self._children.append({"name": name, **_identity(psutil.Process(pid))})
        self._children = [line for line in self._children if _living(line) is not None]
        self._write()

    def close(self) -> None:
        """Everything was stopped in order."""
        self._path.unlink(missing_ok=True)

    def _write(self) -> None:
        document = {
            "supervisor": _identity(psutil.Process()),
            "secret": self._secret,
            "children": self._children,
        }
        write_whole(self._path, json.dumps(document).encode())


def end_orphans(folder: Path, say: Callable[[str], None]) -> int:
    """End what supervisors of this folder left behind that are gone themselves; how many.

    Args:
        folder: Where their lists are.
        say: Gets a line where anything is ended.
    """
    ended = 0
    for path in sorted(folder.glob("serving-*.json")):
        try:
            document = json.loads(path.read_text())
            supervisor, secret = document["supervisor"], str(document["secret"])
            children = list(document["children"])
        except (ValueError, KeyError, TypeError) as error:
            say(f"{path} can't be read ({error}); delete it when nothing of it runs.")
            continue
        if _living(supervisor) is not None:
            continue
        orphans = _orphans(children, secret)
        if orphans:
            names = ", ".join(f"{process.pid}" for process in orphans)
            say(f"An earlier run was killed and left {len(orphans)} processes: ending {names}.")
            _end(orphans)
        ended += len(orphans)
        path.unlink(missing_ok=True)
    return ended


# --- Private -----------------------------------------------------------------------------------


def _identity(process: psutil.Process) -> dict[str, Any]:
    return {"pid": process.pid, "started": process.create_time()}


def _living(line: Mapping[str, Any]) -> psutil.Process | None:
    """The process that was written down, None where it is gone or its number somebody else's."""
    with suppress(psutil.Error, KeyError, TypeError, ValueError):
        process = psutil.Process(int(line["pid"]))
        is_same = abs(process.create_time() - float(line["started"])) < SAME_START_S
        if is_same and process.status() != psutil.STATUS_ZOMBIE:
            return process
    return None


def _orphans(children: list[dict[str, Any]], secret: str) -> list[psutil.Process]:
    noted = [process for line in children if (process := _living(line)) is not None]
    marked = [process for process in psutil.process_iter() if _carries(process, secret)]
    return list({process.pid: process for process in (*noted, *marked)}.values())


def _carries(process: psutil.Process, secret: str) -> bool:
    with suppress(psutil.Error, OSError):  # somebody else's, or gone meanwhile
        return process.pid != os.getpid() and process.environ().get(MARK) == secret
    return False


def _end(processes: list[psutil.Process]) -> None:
    for process in processes:
        with suppress(psutil.NoSuchProcess):
            process.terminate()
    _, stubborn = psutil.wait_procs(processes, timeout=TERM_S)
    for process in stubborn:
        with suppress(psutil.NoSuchProcess):
            process.kill()
    psutil.wait_procs(stubborn, timeout=KILL_S)
