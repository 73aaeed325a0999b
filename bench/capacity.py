"""What one core does in an hour: `python -m bench.capacity [--write]`.

A fresh SQLite installation with the paper's 50 scenarios. The stand-in model answers from a
process of its own, so that the processor time is ours alone: prompt, reply, checks, picture and
rows of an OTM augmentation; a drive of 15 s with PDM-Closed. Stored bytes are those of database
and media. `--write` puts the table into docs/deploying.md.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench.report import ROOT, load, table, write_block
from tests.processes import environment_of

SCENARIOS, DRIVES, PORT = 50, 20, 9154


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", action="store_true", help="into docs/deploying.md")
    is_written = parser.parse_args().write
    before = load()
    with tempfile.TemporaryDirectory(prefix="arena-bench-") as name:
        folder = Path(name)
        os.environ |= environment_of(folder) | {"DJANGO_SETTINGS_MODULE": "arena.config.settings"}
        subprocess.run([sys.executable, "manage.py", "prepare"], cwd=ROOT, check=True)
        rows = measure(folder)
    head = ["per core and hour", "done", "rows", "stored GB", "processor s each", "memory"]
    text = f"`python -m bench.capacity --write`; {before}.\n\n{table(head, rows)}"
    print(text)
    if is_written:
        write_block("capacity", text, page=ROOT / "docs" / "deploying.md")


def measure(folder: Path) -> list[list[str]]:
    """Return the rows of the table."""
    import django

    django.setup()
    from arena.site import demo
    from augment.models import Endpoint, GenerationJob, Simulation
    from augment.services.driving.simulations import Drives, Options, plan_job
    from augment.services.running.jobs import JobRequest, launch
    from augment.services.running.runner import Augmentations

    demo.load_scenarios()
    demo.add_contestants()
    Endpoint.objects.filter(label=demo.STAND_IN).update(base_url=f"http://127.0.0.1:{PORT}/v1")
    model = subprocess.Popen(
        [sys.executable, "manage.py", "fake_llm", "--port", str(PORT)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert model.stdout is not None
        model.stdout.readline()
        scenarios = demo.list_slugs(None)[:SCENARIOS]
        request = JobRequest(name="a", contestants=["sim-good-otm"], scenarios=scenarios)

        def ask() -> list[int]:
            return list(launch(request, None).augmentations.values_list("pk", flat=True))

        first = run("augmentations (OTM)", folder, ask, Augmentations().perform)
    finally:
        model.terminate()
        model.wait()
    job = GenerationJob.objects.get()
    assert job.augmentations.filter(state="done").count() == len(scenarios)
    options = Options(planner="pdm-closed", offsets="paper", is_reactive=False)

    def plan() -> list[int]:
        planned = plan_job(job=job, options=options)
        Simulation.objects.filter(pk__in=planned[DRIVES:]).delete()
        return planned[:DRIVES]

    second = run("drives (PDM-Closed, 15 s)", folder, plan, Drives().perform)
    assert Simulation.objects.filter(state="done").count() == DRIVES
    return [first, second]


def run(
    what: str, folder: Path, plan: Callable[[], list[int]], perform: Callable[[int], Any]
) -> list[str]:
    """Plan rows and work on them one by one in this process; return a row of the table."""
    bytes_before, rows_before = stored_bytes(folder), stored_rows()
    began_s = time.process_time()
    keys = plan()
    for key in keys:
        perform(key)
    each_s = (time.process_time() - began_s) / len(keys)
    gigabytes = (stored_bytes(folder) - bytes_before) / len(keys) / 1e9
    rows, an_hour = (stored_rows() - rows_before) / len(keys), 3_600.0 / each_s
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1_024.0
    figures = [f"{an_hour:,.0f}", f"{an_hour * rows:,.0f}", f"{an_hour * gigabytes:.2f}"]
    return [what, *figures, f"{each_s:.2f}", f"{memory_mb:.0f} MB"]


def stored_bytes(folder: Path) -> int:
    """Return the bytes of database and media, the write-ahead log emptied."""
    from django.db import connection

    connection.cursor().execute("PRAGMA wal_checkpoint(TRUNCATE)")
    files = (path for path in folder.rglob("*") if path.is_file())
    return sum(path.stat().st_size for path in files)


def stored_rows() -> int:
    """Return the number of rows in all tables."""
    from django.apps import apps

    return sum(model._default_manager.count() for model in apps.get_models())


if __name__ == "__main__":
    main()
