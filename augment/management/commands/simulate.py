"""Drive a job's results, or one scenario, in closed loop and print the driving scores."""

import time
from argparse import ArgumentParser
from collections.abc import Collection
from typing import Any, Final

from django.db import transaction
from django.db.models import Q

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
from augment.tasks import check_broker, enqueue_simulations

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
        parser.add_argument("--score", default="nuplan", choices=list(SCORES))
        parser.add_argument(
            "--queue", action="store_true", help="leave the drives to the workers and return"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Plan the rows, drive them here or queue them, then say the scores."""
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
            if job is None:
                assert scenario is not None
                waiting = simulations.plan_scenario(scenario=scenario, options=how, also=also)
                which = Q(scenario=scenario, augmentation=None)
            else:
                waiting = simulations.plan_job(job=job, options=how, also=also)
                which = drives_of_job(job)
            if options["queue"]:
                transaction.on_commit(lambda: enqueue_simulations(waiting))
        if options["queue"]:
            self.stdout.write(f"{len(waiting)} drives wait for the workers.")
            return
        asked = how.of(Simulation.objects.filter(which)).order_by("pk")
        # A worker that runs beside this command may have taken some: they are waited for.
        under_way = list(asked.filter(state__in=Simulation.UNDER_WAY).values_list("pk", flat=True))
        for number, pk in enumerate(under_way, start=1):
            self._say(_finish(pk, also), f"{number}/{len(under_way)}", options["score"])
        if job is not None:
            self._table(scores_of_job(job, options=how, score=options["score"]))
        elif not under_way:
            for row in asked.select_related("scenario"):
                self._say(row, "1/1", options["score"])

    def _say(self, row: Simulation, place: str, score: str) -> None:
        subject = row.get_subject_display()
        who = subject if row.augmentation is None else row.augmentation.contestant.name
        value = getattr(row, SCORES[score])
        clearance = clearance_text(least_clearance_m(row))
        result = row.reason if value is None else f"{100.0 * value:.1f}, clearance {clearance}"
        self.stdout.write(f"[{place}] {row.scenario.slug}, {who}: {result}")
        self.stdout.flush()

    def _table(self, table: DrivingScores) -> None:
        width = max([len(line.name) for line in table.lines], default=10)
        head = f"{'mean driving score, %':{width}}  score  before  drives  failed  clearance"
        self.stdout.write(head)
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


def _finish(pk: int, also: Collection[str]) -> Simulation:
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
