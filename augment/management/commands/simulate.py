"""Drive a job's results, or one scenario, in closed loop and print the driving scores."""

from __future__ import annotations

import time
from argparse import ArgumentParser
from collections.abc import Collection
from typing import Any, Final

from django.db import transaction
from django.db.models import Q

from augment.broker import check_broker
from augment.errors import UnknownName
from augment.models import Scenario, Simulation
from augment.services.judging import simulations
from augment.services.judging.driving_scores import (
    DrivingScores,
    clearance_text,
    drives_of_job,
    least_clearance_m,
    scores_of_job,
)
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.choosing import find_job
from augment.services.terminal import TerminalCommand
from augment.tasks import enqueue_simulations

POLL_S: Final = 0.2


class Command(TerminalCommand):
    """simulate JOB|SCENARIO [--planner P] [--offsets O] [--reactive] [--score S] [--queue]."""

    help = (
        "Let a planner drive every result of a job, with the scenes before the change and with "
        "the reference, for 15 s each; or one scenario. What was driven so before stays."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """What to drive, and how."""
        parser.add_argument("what", help="name or code of a job, or slug of a scenario")
        parser.add_argument(
            "--planner",
            default="pdm-closed",
            help="pdm-closed, idm, or a class's dotted path; the workers (--queue) load "
            "only the ones of ARENA_PLANNERS",
        )
        parser.add_argument(
            "--offsets",
            default="paper",
            help="lateral offsets of PDM-Closed: paper (-4 to 4 m) or original (-1, 0, 1 m)",
        )
        parser.add_argument(
            "--reactive",
            action="store_true",
            help="recorded vehicles answer to the ego instead of being replayed",
        )
        parser.add_argument("--score", default="nuplan", help=f"one of {', '.join(SCORES)}")
        parser.add_argument(
            "--queue", action="store_true", help="leave the drives to the workers and return"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Plan the rows, drive them here or queue them, then say the scores."""
        if options["score"] not in SCORES:
            raise UnknownName("score", options["score"], list(SCORES))
        self._simulate(options)

    def _simulate(self, options: dict[str, Any]) -> None:
        how = Options(
            planner=options["planner"], offsets=options["offsets"], is_reactive=options["reactive"]
        )
        scenario = Scenario.objects.filter(slug=options["what"]).first()
        job = None if scenario is not None else find_job(options["what"])
        also = () if options["queue"] else (how.planner,)
        simulations.load_planner(how, also=also)
        if options["queue"]:
            check_broker()
        with transaction.atomic():
            if scenario is not None:
                waiting = simulations.plan_scenario(scenario=scenario, options=how, also=also)
            else:
                assert job is not None
                waiting = simulations.plan_job(job=job, options=how, also=also)
            if options["queue"]:
                transaction.on_commit(lambda: enqueue_simulations(waiting))
        if options["queue"]:
            self.stdout.write(f"{len(waiting)} drives wait for the workers.")
            return
        rows = drives_of_job(job) if job is not None else Q(scenario=scenario, augmentation=None)
        asked = how.of(Simulation.objects.filter(rows))
        # A worker that runs beside this command may have taken some: they are waited for.
        open_rows = list(asked.filter(state__in=Simulation.UNDER_WAY).order_by("pk"))
        for number, row in enumerate(open_rows, start=1):
            self._say(_finished(row.pk, also), number, len(open_rows), options["score"])
        if job is not None:
            self._table(scores_of_job(job, options=how, score=options["score"]))
        elif not open_rows:
            for row in asked.select_related("scenario"):
                self._say(row, 1, 1, options["score"])

    def _say(self, row: Simulation, number: int, total: int, score: str) -> None:
        who = (
            row.get_subject_display()
            if row.augmentation is None
            else row.augmentation.contestant.name
        )
        value = getattr(row, SCORES[score])
        clearance = clearance_text(least_clearance_m(row))
        said = row.reason if value is None else f"{100.0 * value:.1f}, clearance {clearance}"
        self.stdout.write(f"[{number}/{total}] {row.scenario.slug}, {who}: {said}")
        self.stdout.flush()

    def _table(self, table: DrivingScores) -> None:
        width = max([len(line.name) for line in table.lines], default=10)
        self.stdout.write(
            f"{'mean driving score, %':{width}}  score  before  drives  failed  clearance"
        )
        for line in table.lines:
            mean, before = (
                "-" if value is None else f"{100.0 * value:.1f}"
                for value in (line.mean, line.before)
            )
            self.stdout.write(
                f"{line.name:{width}}  {mean:>5}  {before:>6}  {line.drives:>6}  {line.failed:>6}"
                f"  {clearance_text(line.least_clearance_m)}"
            )
        if table.outlasting:
            self.stdout.write(
                f"In {table.outlasting} of {table.total} drives the recording ends before the "
                "drive: traffic and expert are carried on."
            )


# Private


def _finished(pk: int, also: Collection[str]) -> Simulation:
    """Drive a row, or wait until the worker that has it is done or has fallen silent."""
    drives = simulations.Drives(also)
    rows = Simulation.objects.select_related("scenario", "augmentation__contestant")
    while True:
        drives.perform(pk)
        row = rows.get(pk=pk)
        if row.state not in Simulation.UNDER_WAY:
            return row
        time.sleep(POLL_S)
        drives.take_back_lost()
