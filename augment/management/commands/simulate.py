"""Drive a job's results, one scenario, or files; `export driving` has the means of a job."""

from pathlib import Path
from typing import Any

from django.core.management.base import CommandError
from django.db import transaction
from django.db.models import Q

from augment.models import Scenario, Simulation
from augment.services.driving import driving_scores, simulations
from augment.services.driving.drive_files import drive_files, read_shard
from augment.services.driving.simulations import SCORES, Options
from augment.services.running.choosing import find_job
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_simulations


class Command(TerminalCommand):
    """simulate JOB|SCENARIO|FOLDER [--planner P] [--queue] [--to FOLDER --shard I/N] ..."""

    help = (
        "Let a planner drive every result of a job, with the scenes before the change and with "
        "the reference, for 15 s each (interPlan's own for 30 s); or one scenario. What was "
        "driven so before stays, and its scores are printed."
    )

    arguments = {
        "what": {
            "help": "name or code of a job, slug of a scenario, or with --to a folder of "
            "scenarios as `export scenarios --format json` and `sweep --to` write it"
        },
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
        "--queue": {"action": "store_true", "help": "leave the drives to the workers and return"},
        "--to": {"type": Path, "help": "a folder for one JSON a drive; needs no database"},
        "--shard": {
            "default": "1/1",
            "help": "with --to: the I-th of N parts, such as 2/8, for one task of an array",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Plan the rows, then drive them here or queue them; print a line for each drive."""
        how = Options(
            planner=options["planner"], offsets=options["offsets"], is_reactive=options["reactive"]
        )
        if options["to"] is not None:
            self._drive_files(options, how)
            return
        scenario = Scenario.objects.filter(slug=options["what"]).first()
        job = None if scenario is not None else find_job(options["what"])
        also = () if options["queue"] else (how.planner,)
        simulations.load_planner(how, also=also)
        if options["queue"]:
            check_broker()
        with transaction.atomic():
            if scenario is not None:
                waiting = simulations.plan_scenario(scenario=scenario, options=how, also=also)
                drives = Simulation.OF_SCENES & Q(scenario=scenario)
            else:
                assert job is not None
                waiting = simulations.plan_job(job=job, options=how, also=also)
                drives = driving_scores.drives_of_job(job)
            if options["queue"]:
                transaction.on_commit(lambda: enqueue_simulations(waiting))
        if options["queue"]:
            self.stdout.write(f"{len(waiting)} drives wait for the workers.")
            return
        rows = how.of(Simulation.objects.filter(drives)).order_by("pk")
        keys = list(rows.values_list("pk", flat=True))
        for number, pk in enumerate(keys, start=1):
            if pk in waiting:
                simulations.Drives(also).perform(pk)
            self._say(pk, f"{number}/{len(keys)}")

    def _drive_files(self, options: dict[str, Any], how: Options) -> None:
        source, shard = Path(options["what"]), read_shard(options["shard"])
        failed = number = 0
        for name, outcome in drive_files(source, options["to"], options=how, shard=shard):
            number += 1
            failed += isinstance(outcome, str)
            result = outcome if isinstance(outcome, str) else f"nuPlan {100.0 * outcome:.1f}"
            self.stdout.write(f"{name}: {result}")
            self.stdout.flush()
        if failed:
            raise CommandError(f"{failed} of {number} can't be driven; the others are written.")

    def _say(self, pk: int, place: str) -> None:
        row = Simulation.objects.select_related("scenario", "augmentation__contestant").get(pk=pk)
        who = row.augmentation.contestant.name if row.augmentation else row.get_subject_display()
        result = row.reason or "driven by a worker"
        if row.state == Simulation.State.DONE:
            nuplan, interplan = (100.0 * (getattr(row, name) or 0.0) for name in SCORES.values())
            least_m = driving_scores.least_clearance_m(row)
            clearance = driving_scores.clearance_text(least_m)
            result = f"nuPlan {nuplan:.1f}, interPlan {interplan:.1f}, clearance {clearance}"
        self.stdout.write(f"[{place}] {row.scenario.slug}, {who}: {result}")
        self.stdout.flush()
