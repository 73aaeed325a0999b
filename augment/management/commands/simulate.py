"""Drive a job's results, or one scenario, in closed loop and print the driving scores."""

from typing import Any

from django.db import transaction

from augment.models import Scenario, Simulation
from augment.services.judging import simulations
from augment.services.judging.driving_scores import (
    DrivingScores,
    clearance_text,
    least_clearance_m,
    scores_of_job,
)
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.choosing import find_job
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_simulations


class Command(TerminalCommand):
    """simulate JOB|SCENARIO [--planner P] [--offsets O] [--reactive] [--score S] [--queue]."""

    help = (
        "Let a planner drive every result of a job, with the scenes before the change and with "
        "the reference, for 15 s each; or one scenario. What was driven so before stays."
    )

    arguments = {
        "what": {"help": "name or code of a job, or slug of a scenario"},
        "--planner": {
            "default": "pdm-closed",
            "help": "pdm-closed, idm, or a class's dotted path; the workers (--queue) load only "
            "the ones of ARENA_PLANNERS",
        },
        "--offsets": {
            "default": "paper",
            "help": "of PDM-Closed: paper (-4 to 4 m) or original (-1, 0, 1 m)",
        },
        "--reactive": {
            "action": "store_true",
            "help": "recorded vehicles answer to the ego instead of being replayed",
        },
        "--score": {"default": "nuplan", "choices": list(SCORES)},
        "--queue": {"action": "store_true", "help": "leave the drives to the workers and return"},
    }

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
        for number, pk in enumerate(waiting, start=1):
            simulations.Drives(also).perform(pk)
            self._say(pk, f"{number}/{len(waiting)}", options["score"])
        if job is not None:
            self._table(scores_of_job(job, options=how, score=options["score"]))

    def _say(self, pk: int, place: str, score: str) -> None:
        row = Simulation.objects.select_related("scenario", "augmentation__contestant").get(pk=pk)
        subject = row.get_subject_display()
        who = subject if row.augmentation is None else row.augmentation.contestant.name
        value = getattr(row, SCORES[score])
        result = row.reason or "driven by a worker"
        if value is not None:
            clearance = clearance_text(least_clearance_m(row))
            result = f"{100.0 * value:.1f}, clearance {clearance}"
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
