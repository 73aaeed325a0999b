"""What the tests take from the machine, all of it named here; whatever else is set does not count.

A pytest plugin (pyproject.toml loads it), so that it runs before Django reads its settings. What
the tests start inherits it: a home of its own, English, UTC, one thread for linear algebra (its
sums depend on how many there are). Fonts are named in tests/browser/fonts.py.
"""

import atexit
import os
import shutil
import tempfile
from pathlib import Path

VAR = "ARENA_TESTS_VAR"
KEPT = {
    "PATH": "where Python, a Chromium, a redis-server and PostgreSQL's programs are found",
    "TMPDIR": "where temporary folders lie",
    "LD_LIBRARY_PATH": "where programs of wheels find their libraries",
    "CI": "whether a part that can't run fails instead of being skipped",
    "REALDATA_DIR": "where the recorded scenes lie",
    "CHROMIUM": "a Chromium that is not on the PATH",
    "PLAYWRIGHT_BROWSERS_PATH": "where Playwright has put a Chromium",
    "DATABASE_URL": "the PostgreSQL of tests.on_postgres",
    "HYPOTHESIS_STORAGE_DIRECTORY": "where examples that failed are kept",
    VAR: "where the database lies that `--reuse-db` finds again",
}
FIXED = {"LC_ALL": "C.UTF-8", "TZ": "UTC", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
STARTED = "ARENA_TESTS_HOME"
"""Tells a worker of xdist that its home has been made."""
MOST_BYTES = 4 << 30
"""What all tests leave behind until the end."""


def roomy_memory() -> Path | None:
    """Return a file system in memory with room for what the tests write, if there is one.

    Each vote, picture and file that is written is confirmed by the disk, which takes most of it.
    """
    memory = Path("/dev/shm")
    has_room = memory.is_dir() and shutil.disk_usage(memory).free > MOST_BYTES
    return memory if has_room else None


def fix_environment() -> None:
    """Leave what is named, set what is fixed, and make an empty home."""
    if STARTED in os.environ:
        return
    kept = {
        name: value
        for name, value in os.environ.items()
        if name in KEPT or name.startswith(("PYTEST_", "COVERAGE_"))
    }
    browsers = Path(os.environ.get("HOME", "/nonexistent")) / ".cache" / "ms-playwright"
    home = tempfile.mkdtemp(prefix="arena-", dir=None if "TMPDIR" in kept else roomy_memory())
    # In a folder of all runs the next one would take the database away from under this one.
    own = {"HOME": home, "ARENA_VAR_DIR": kept.get(VAR, f"{home}/var"), STARTED: home}
    own |= {} if "TMPDIR" in kept else {"TMPDIR": home}
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    os.environ.clear()
    os.environ.update({"PLAYWRIGHT_BROWSERS_PATH": str(browsers)} | kept | FIXED | own)


fix_environment()
