"""Reads hostile files in a process that may not take more than a gigabyte, and says what happened.

    python -m tests.formats.hostile_child PLAN.json

PLAN is a list of [name, reader, path]; printed is a line of JSON for each.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path

import pyarrow.parquet  # noqa: F401  what readers load late counts as loaded

from augment.errors import InvalidDocument
from augment.formats.readers import reader_of

MOST_BYTES = 1 << 30


def _peak_mb() -> float:
    """What this program had in memory at most; getrusage would count whoever started it."""
    status = Path("/proc/self/status").read_text()
    (line,) = (one for one in status.splitlines() if one.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def main() -> None:
    """Read one after the other."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    for name, reader, path in json.loads(Path(sys.argv[1]).read_text()):
        began = time.process_time()
        try:
            reader_of(reader).read(Path(path), item=None, frame=None, name="hostile")
            said = "was read"
        except InvalidDocument as fault:
            said = f"refused: {fault}"
        except BaseException as fault:
            said = f"{type(fault).__name__}: {fault}"
        took_s = time.process_time() - began
        print(json.dumps([name, said[:300], round(took_s, 2), round(_peak_mb())]), flush=True)


if __name__ == "__main__":
    main()
