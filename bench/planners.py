"""Planners told apart: `python -m bench.planners FOLDER [--write]`.

PDM-Closed with the paper's and with the original offsets, the IDM and the example planner of
docs/simulation.md drive every scenario of the paper, the hard and the moving set, before the
change and with the reference. FOLDER keeps a database, so that a run that was stopped goes on.
`export driving --planners` makes the table.
"""

import argparse
import json
import os
import random
import re
import subprocess
import sys
from io import StringIO
from pathlib import Path
from typing import Any

from bench.report import ROOT, load, table, write_section

HEADING = "Planners told apart"
SETS = ("paper", "hard", "moving")
EXAMPLE = "my_planners.AlongTheCentreline"
PLANNERS = ("pdm-closed", "pdm-closed:original", "idm", EXAMPLE)
PROCESSES = 2
NOTE = (
    "`python -m bench.planners FOLDER [--write]`: nuPlan's score in percent of what was driven "
    "with references by then, scenarios in random order; 95 % intervals clustered by scene; "
    "planners that share a letter can't be told apart"
)


def prepare(folder: Path) -> None:
    """Load the sets, make a job of each, and plan all drives."""
    example = re.search(
        r"```python\n(.*?)```", (ROOT / "docs" / "simulation.md").read_text(), re.S
    )
    assert example is not None
    (folder / "my_planners.py").write_text(example[1])
    from django.core.management import call_command

    from augment.models import GenerationJob, Scenario
    from augment.services.driving import plan_scenario
    from augment.services.driving.simulations import Options
    from augment.services.running.jobs import JobRequest, launch

    call_command("prepare")
    for name in SETS:
        call_command("load_catalogue", "--set", name)
        rows = list(Scenario.objects.filter(catalogue_set=name, paraphrase_of=None))
        if not GenerationJob.objects.filter(name=name).exists():
            slugs = [row.slug for row in rows]
            launch(JobRequest(name=name, contestants=["reference"], scenarios=slugs))
        for planner, _, offsets in (spec.partition(":") for spec in PLANNERS):
            options = Options(planner=planner, offsets=offsets or "paper")
            for row in rows:
                plan_scenario(scenario=row, options=options, also=[EXAMPLE])


def work(seed: int) -> None:
    """Drive what waits, the scenes with references first and all planners on one after another."""
    from augment.models import Simulation
    from augment.services.driving.simulations import Drives

    kind = Drives(also=[EXAMPLE])
    waiting = Simulation.objects.filter(state=Simulation.State.QUEUED)
    order = list(waiting.order_by("pk").values_list("scenario", flat=True).distinct())
    random.Random(0).shuffle(order)
    for subject in (Simulation.Subject.REFERENCE, Simulation.Subject.UNMODIFIED):
        for scenario in order[seed::PROCESSES]:
            rows = waiting.filter(scenario=scenario, subject=subject)
            for pk in rows.values_list("pk", flat=True):
                kind.perform(pk, worker=str(os.getpid()))


def make_table() -> str:
    """Return a row a set: the scenes with references, as the command writes them."""
    from django.core.management import call_command

    rows = []
    for name in SETS:
        written = StringIO()
        arguments = ["driving", name, "--planners", *PLANNERS, "--format", "json", "--out", "-"]
        call_command("export", *arguments, stdout=written)
        lines = json.loads(written.getvalue())["lines"]
        means = [
            line for line in lines if line["scenarios"] == "Reference" and not line["against"]
        ]
        drives = [line["drives"] for line in means]
        scenes = [line["scenes"] for line in means]
        counts = f"{min(drives)} to {max(drives)} on {min(scenes)} to {max(scenes)}"
        rows.append([name, counts, *map(_cell, means)])
    return table(["set", "drives on scenes", "PDM-Closed, paper", *PLANNERS[1:3], "example"], rows)


def _cell(line: dict[str, Any]) -> str:
    mean, low, high = (line[f"{name}_percent"] for name in ("mean", "low", "high"))
    return f"{mean:.1f} [{low:.1f}, {high:.1f}] {line['sets']}"


def main() -> None:
    """Drive what is not driven yet, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", action="store_true", help="write what is driven by now")
    parser.add_argument("--work", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    os.environ |= {
        "DJANGO_SETTINGS_MODULE": "arena.config.settings",
        "ARENA_VAR_DIR": str(folder),
        "ARENA_MEDIA_DIR": str(folder / "media"),
        "OPENBLAS_NUM_THREADS": "1",
    }
    sys.path.append(str(folder))
    import django

    django.setup()
    if options.work is not None:
        work(options.work)
        return
    if options.write:
        write_section(HEADING, f"{NOTE}; {load()}.\n\n{make_table()}")
        return
    prepare(folder)
    command = [sys.executable, "-m", "bench.planners", str(folder), "--work"]
    workers = [subprocess.Popen([*command, str(seed)]) for seed in range(PROCESSES)]
    assert not any(worker.wait() for worker in workers)


if __name__ == "__main__":
    main()
