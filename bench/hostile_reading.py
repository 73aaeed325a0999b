"""What each hostile file takes until it is refused: `python -m bench.hostile_reading`."""

from __future__ import annotations

import resource
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from augment.errors import InvalidDocument
from augment.formats.apart import UntrustedInput
from bench.report import table
from tests.formats.hostile_files import HOSTILE

SHOWN_S, SHOWN_MB = 2.0, 300


class Refusal(NamedTuple):
    """What one file took."""

    name: str
    cpu_s: float
    most_mb: int
    reason: str


def refuse(name: str) -> Refusal:
    """Read a file as the product does, in a process that has no other children."""
    with TemporaryDirectory() as root, ProcessPoolExecutor(1) as pool:
        return pool.submit(_refuse, name, root).result()


def hostile_table() -> str:
    """Read every file; those that take much have a row of their own."""
    refusals = sorted(map(refuse, HOSTILE), key=lambda one: -one.cpu_s)
    large = [one for one in refusals if one.cpu_s > SHOWN_S or one.most_mb > SHOWN_MB]
    small = [one for one in refusals if one not in large]
    rows = [
        [one.name.replace("_", " "), f"{one.cpu_s:.1f}", str(one.most_mb), one.reason]
        for one in large
    ]
    rows.append(
        [
            f"the other {len(small)}, at most",
            f"{max(one.cpu_s for one in small):.1f}",
            str(max(one.most_mb for one in small)),
            "what is wrong with each",
        ]
    )
    return table(["file", "CPU (s)", "MB at most", "reason"], rows)


def _refuse(name: str, root: str) -> Refusal:
    source, path = HOSTILE[name](Path(root))
    try:
        UntrustedInput(path=path, format=source).read(item=None, frame=None, name="hostile")
    except InvalidDocument as fault:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        reason = fault.problems[0][1]
        return Refusal(name, used.ru_utime + used.ru_stime, used.ru_maxrss >> 10, str(reason))
    raise AssertionError(f"{name} was read")


if __name__ == "__main__":
    print(hostile_table())
