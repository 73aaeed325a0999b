"""Queries and time of every page, small and large: `python -m tests.benchmarks.pages`.

Two installations on SQLite: 900 votes on 450 pictures, and 100,000 votes on 10,008. Every page
that staff open, and an expert's voting page, is fetched with everything else as in production;
queries are counted, times are medians of five. A page whose queries grow with the rows asks once
a row somewhere.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import django

ROOT = Path(__file__).resolve().parents[2]
SIZES = {
    "small": {"scenarios": 50, "experts": 9, "votes_per_expert": 100},
    "large": {"scenarios": 1112, "experts": 100, "votes_per_expert": 1000},
}
TIMES = 5
TARGET_MS = 200.0


def main() -> None:
    """Print both side by side; those beyond the target, or with more queries, are marked."""
    before = os.getloadavg()[0]
    found = {size: _measured(size) for size in SIZES}
    print(f"medians of {TIMES}; {os.cpu_count()} cores, load average before {before:.1f}\n")
    print("| page | queries, small | queries, large | ms, small | ms, large | |")
    print("|---|---|---|---|---|---|")
    for name, (queries, took) in found["large"].items():
        fewer, quicker = found["small"][name]
        mark = " ".join(
            word
            for word, is_so in (
                ("**more queries**", queries > fewer),
                (f"**beyond {TARGET_MS:.0f} ms**", took > TARGET_MS),
            )
            if is_so
        )
        print(f"| {name} | {fewer} | {queries} | {quicker:.0f} | {took:.0f} | {mark} |")


# --- Private -----------------------------------------------------------------------------------


def _measured(size: str) -> dict[str, tuple[int, float]]:
    with tempfile.TemporaryDirectory(prefix="arena-pages-") as folder:
        environment = {
            **os.environ,
            "ARENA_VAR_DIR": f"{folder}/var",
            "ARENA_MEDIA_DIR": f"{folder}/media",
            "DATABASE_URL": f"sqlite:///{folder}/db.sqlite3",
            "DJANGO_SETTINGS_MODULE": "arena.config.settings",
            "ARENA_LOG_LEVEL": "error",
        }
        ended = subprocess.run(
            [sys.executable, "-m", "tests.benchmarks.pages", size],
            cwd=ROOT,
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    return {name: (queries, took) for name, queries, took in json.loads(ended.stdout)}


def _visit(size: str) -> None:
    """In a process of its own: fill the database, then open every page."""
    django.setup()
    from django.contrib.auth.models import User
    from django.core.management import call_command

    from arena.services.people import create_person
    from arena.services.ratings import rate
    from arena.services.studies import close_study, open_study
    from arena.web.results_tabs import TABS
    from augment.models import Augmentation
    from tests import full_study as made
    from tests.web.addresses import address
    from tests.web.cast import World
    from tests.web.test_access import ACTIONS, PAGES

    call_command("migrate", verbosity=0)
    call_command("collectstatic", verbosity=0, interactive=False)
    how = made.Size(**SIZES[size])
    rated, places = made.contestants(), made.scenarios(how.scenarios)
    made.pictures(places, rated)
    experts = [f"expert-{number}" for number in range(1, how.experts + 1)]
    for username in experts:
        create_person(username=username, password=None, role="expert")
    admin = create_person(username="root", password=None, role="admin")
    study = open_study(
        name="Round 1",
        contestants=[row.slug for row in rated],
        scenarios=[place.slug for place in places],
        experts=experts,
        votes_per_expert=how.votes_per_expert,
        seed=1,
    )
    augmentation = Augmentation.objects.select_related("job")[0]
    here = World(
        study=study,
        job=augmentation.job,
        augmentation=augmentation,
        expert=User.objects.get(username="expert-1"),
    )
    rows = [_opened("vote", here.expert, address("vote", here))]
    made.draw_votes(study, size=how, seed=1)
    study = close_study(study=study)
    rate(study=study, seed=1)
    for name in PAGES:
        if name not in {"vote", "vote-help", *ACTIONS}:
            rows += [_opened(name, admin, address(name, here))]
    for tab in TABS:
        rows += [_opened(f"results: {tab.name}", admin, f"{address('results', here)}{tab.name}/")]
    json.dump([row for row in rows if row is not None], sys.stdout)


def _opened(name: str, user: object, url: str) -> tuple[str, int, float] | None:
    """None where there is no such page for what was made here."""
    from django.db import connection
    from django.test import Client
    from django.test.utils import CaptureQueriesContext

    client = Client()
    client.force_login(user)  # type: ignore[arg-type]
    took = []
    for _ in range(TIMES):
        began = time.perf_counter()
        with CaptureQueriesContext(connection) as asked:
            answer = client.get(url, headers={"host": "localhost"})
            if answer.streaming:
                b"".join(answer)
        took.append(1e3 * (time.perf_counter() - began))
    if answer.status_code != 200:
        print(f"{name}: {answer.status_code}", file=sys.stderr)
        return None
    return name, len(asked), statistics.median(took)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _visit(sys.argv[1])
    else:
        main()
