"""Queries and time of every page, small and large: `python -m bench.pages [FOLDER]`.

Two installations on SQLite: 900 votes on 450 pictures, and 100,000 votes on 10,008. Every page
that staff open, an expert's voting page and the lists of the API are fetched with everything else
as in production; queries are counted, times are medians of five: processor time of the thread,
since what else runs on the machine is nobody's concern. A page whose queries grow with the rows
asks once a row somewhere. With a folder, what was filled there is kept and used again.
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
from typing import Any

import django

ROOT = Path(__file__).resolve().parents[1]
SIZES = {
    "small": {"scenarios": 50, "experts": 9, "votes_per_expert": 100},
    "large": {"scenarios": 1112, "experts": 100, "votes_per_expert": 1000},
}
TIMES = 5
TARGET_MS = 200.0
ENOUGH_MS = 5000.0
"""After so much a page is not asked again: one that takes seconds does so every time."""
STUDY = "Round 1"
FILE = " (whole file)"
"""A file of everything takes as long as everything: no target holds for it."""


def main() -> None:
    """Print both side by side; those beyond the target, or with more queries, are marked."""
    before = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="arena-pages-") as folder:
        kept = Path(sys.argv[1] if len(sys.argv) > 1 else folder).resolve()
        found = {size: _measured(size, kept / size) for size in SIZES}
    print(f"medians of {TIMES}; {os.cpu_count()} cores, load average before {before:.1f}\n")
    print("| page | queries, small | queries, large | ms, small | ms, large | |")
    print("|---|---|---|---|---|---|")
    for name, (queries, took) in found["large"].items():
        if name not in found["small"]:
            continue
        fewer, quicker = found["small"][name]
        mark = " ".join(
            word
            for word, is_so in (
                ("**more queries**", queries > fewer),
                (f"**beyond {TARGET_MS:.0f} ms**", took > TARGET_MS and FILE not in name),
            )
            if is_so
        )
        print(f"| {name} | {fewer} | {queries} | {quicker:.0f} | {took:.0f} | {mark} |")


# --- Private -----------------------------------------------------------------------------------


def _measured(size: str, folder: Path) -> dict[str, tuple[int, float]]:
    folder.mkdir(parents=True, exist_ok=True)
    environment = {
        **os.environ,
        "ARENA_VAR_DIR": f"{folder}/var",
        "ARENA_MEDIA_DIR": f"{folder}/media",
        "DATABASE_URL": f"sqlite:///{folder}/db.sqlite3",
        "DJANGO_SETTINGS_MODULE": "arena.config.settings",
        "ARENA_LOG_LEVEL": "error",
    }
    if not (folder / "filled").exists():
        _run("fill", size, environment)
        (folder / "filled").touch()
    said = _run("visit", size, environment)
    return {name: (queries, took) for name, queries, took in json.loads(said)}


def _run(what: str, size: str, environment: dict[str, str]) -> str:
    """What a process of its own printed."""
    return subprocess.run(
        [sys.executable, "-m", "bench.pages", what, size],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout


def _fill(size: str) -> None:
    """A study that was voted to the end and rated, on pictures of a job of models."""
    began = time.monotonic()
    from django.core.management import call_command
    from django.db import transaction

    from arena.people.services import create_person
    from arena.services.ratings import rate
    from arena.studies.services.opening import close_study
    from augment.models import Augmentation, Scenario
    from augment.scene.codec import modification_to_document
    from tests import full_study as made
    from tests.jobs.rows import TWO_CONES
    from tests.opening import open_study

    call_command("migrate", verbosity=0)
    call_command("collectstatic", verbosity=0, interactive=False)
    how = made.Size(**SIZES[size])
    with transaction.atomic():
        rated, places = made.contestants(), made.scenarios(how.scenarios)
        made.pictures(places, rated)
        change = modification_to_document(TWO_CONES)
        Scenario.objects.update(reference=change)
        Augmentation.objects.update(modification=change)
        experts = [f"expert-{number}" for number in range(1, how.experts + 1)]
        for username in experts:
            create_person(username=username, password=None, role="expert")
        create_person(username="root", password=None, role="admin")
        study = open_study(
            name=STUDY,
            contestants=[row.slug for row in rated],
            scenarios=[place.slug for place in places],
            experts=experts,
            votes_per_expert=how.votes_per_expert,
            seed=1,
        )
        made.draw_votes(study, size=how, seed=1)
        _add_calls(how.scenarios)
    study = close_study(study=study)
    rate(study=study, seed=1)
    print(f"{size}: filled in {time.monotonic() - began:.0f} s", file=sys.stderr)


def _add_calls(places: int) -> None:
    """What language models were asked: one attempt and two calls for each augmentation."""
    from django.utils import timezone

    from augment.models import (
        Attempt,
        Augmentation,
        Contestant,
        Endpoint,
        EndpointModel,
        Event,
        ModelCall,
    )
    from tests.full_study import PAPERS

    now = timezone.now()
    site = Endpoint.objects.create(label="here", base_url="http://127.0.0.1:1/v1")
    EndpointModel.objects.create(endpoint=site, model="m")
    for slug, _, variant, _ in PAPERS:
        if variant:
            Contestant.objects.filter(slug=slug).update(
                kind=Contestant.Kind.LLM, variant=variant, endpoint=site, model="m"
            )
    rows = Augmentation.objects.filter(contestant__kind=Contestant.Kind.LLM)
    tries = Attempt.objects.bulk_create(
        Attempt(
            augmentation_id=key, number=1, worker="w", started_at=now, finished_at=now,
            outcome="done",
        )
        for key in rows.values_list("pk", flat=True)
    )  # fmt: skip
    request = {"model": "m", "messages": [{"role": "user", "content": "Park a car. " * 170}]}
    ModelCall.objects.bulk_create(
        (
            ModelCall(
                attempt=one, number=number, role="modifier", request=request, answer="{}" * 200,
                model_returned="m", prompt_tokens=500, completion_tokens=100, started_at=now,
                sent_at=now, settled_at=now, spent_tokens=600, latency_s=1.0,
            )
            for one in tries
            for number in (1, 2)
        ),
        batch_size=500,
    )  # fmt: skip
    Event.objects.bulk_create(
        Event(verb="retry", object_kind="augmentation", object_code=str(number))
        for number in range(20 * places)
    )


def _visit() -> None:
    """Open every page; what is changed for it is taken back."""
    from django.contrib.auth.models import User
    from django.db import transaction

    from arena.models import Study
    from arena.web.results.tabs import TABS
    from augment.models import Augmentation
    from tests.web.addresses import address
    from tests.web.cast import World
    from tests.web.test_access import ACTIONS, PAGES

    study = Study.objects.get(name=STUDY)
    augmentation = Augmentation.objects.select_related("job")[0]
    expert = User.objects.get(username="expert-1")
    here = World(study=study, job=augmentation.job, augmentation=augmentation, expert=expert)
    admin = User.objects.get(username="root")
    rows = []
    with transaction.atomic():
        Study.objects.filter(pk=study.pk).update(state=Study.State.OPEN)
        rows += [_opened("vote", expert, address("vote", here))]
        for name in ("home", "studies", "study", "experts", "enrolment"):
            rows += [_opened(f"{name}, study open", admin, address(name, here))]
        transaction.set_rollback(True)
    for name in PAGES:
        if name not in {"vote", "vote-help", "report", *ACTIONS}:
            rows += [_opened(name, admin, address(name, here))]
    for tab in TABS:
        rows += [_opened(f"results: {tab.name}", admin, f"{address('results', here)}{tab.name}/")]
    rows += [_opened(f"api: {url}", admin, f"/api/v1/{url}") for url in _lists()]
    json.dump([row for row in rows if row is not None], sys.stdout)


def _lists() -> list[str]:
    return ["scenarios", "contestants", "jobs", "studies"]


def _opened(name: str, user: Any, url: str) -> tuple[str, int, float] | None:
    """None where there is no such page for what was made here."""
    from django.db import connection
    from django.test import Client
    from django.test.utils import CaptureQueriesContext

    client = Client(raise_request_exception=False)
    client.force_login(user)
    took: list[float] = []
    for _ in range(TIMES):
        if sum(took) > ENOUGH_MS:
            break
        began = time.thread_time()
        with CaptureQueriesContext(connection) as asked:
            answer = client.get(url, headers={"host": "localhost"})
            if answer.streaming:
                b"".join(answer)
        took.append(1e3 * (time.thread_time() - began))
    if answer.status_code != 200:
        print(f"{name}: {answer.status_code}", file=sys.stderr)
        return None
    if "attachment" in answer.headers.get("Content-Disposition", ""):
        name += FILE
    return name, len(asked), statistics.median(took)


if __name__ == "__main__":
    if sys.argv[1:2] == ["fill"]:
        django.setup()
        _fill(sys.argv[2])
    elif sys.argv[1:2] == ["visit"]:
        django.setup()
        _visit()
    else:
        main()
