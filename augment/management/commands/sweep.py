"""Sweep one number of a scenario: where a planner fails, and the hardest value that is solved."""

from pathlib import Path
from typing import Any

from django.db import transaction

from augment.services.driving import simulations
from augment.services.driving.sweeps import SweepRequest, plan_sweep, write_values
from augment.services.driving.thresholds import SweepResult, sweep_result
from augment.services.inputs import read_request
from augment.services.scenarios.scenes import scenario_named
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_row


class Command(TerminalCommand):
    """sweep SCENARIO NUMBER --low A --high B [--count N] [--planner P] [--queue | --to FOLDER]."""

    help = (
        "Drive a scenario at several values of one of its numbers, with the planner under test "
        "and with PDM-Closed and IDM. The hardest value that one of these solves and the planner "
        "does not is kept as a scenario."
    )
    arguments = {
        "scenario": {"help": "its slug"},
        "--queue": {"action": "store_true", "help": "leave the drives to the workers"},
        "--to": {"type": Path, "help": "drive nothing: write scenarios for `simulate --to` there"},
    }
    request = SweepRequest

    def handle(self, *args: Any, **options: Any) -> None:
        """Write the values, or plan their drives and drive or queue them."""
        scenario = scenario_named(options["scenario"])
        request, out = read_request(SweepRequest, options), options["to"]
        if out is not None:
            files = write_values(scenario, request)
            out.mkdir(parents=True, exist_ok=True)
            for name, content in files.items():
                (out / name).write_bytes(content)
            self.stdout.write(f"{len(files)} files are in {out}.")
            return
        also = () if options["queue"] else (request.planner,)
        if options["queue"]:
            check_broker()
        sweep = plan_sweep(scenario=scenario, request=request, also=also)
        if options["queue"]:
            transaction.on_commit(lambda: enqueue_row(sweep))
            self.stdout.write(f"{sweep_result(sweep).planned} drives wait for the workers.")
            return
        waiting = [drive.pk for line in sweep_result(sweep).lines for drive in line.drives]
        for number, pk in enumerate(waiting, start=1):
            simulations.Drives(also).perform(pk)
            self.stderr.write(f"[{number}/{len(waiting)}]")
        sweep.refresh_from_db()
        self._say(sweep_result(sweep))

    def _say(self, result: SweepResult) -> None:
        for line in result.lines:
            parts = [
                f"{trial.driver} {100.0 * trial.score:.1f}{'' if trial.is_lawful else ' (fails)'}"
                for trial in line.trials
            ]
            parts += [drive.reason for drive in line.drives if drive.reason]
            self.stdout.write(f"{line.row.value:g}: {'; '.join(parts) or line.row.reason}")
        self.stdout.write(result.verdict)
        scenario = result.sweep.hardest
        told_last = "No value is failed by it and solved by another."
        if result.under_way:
            told_last = f"Workers have {result.under_way} of the drives; the sweep's page goes on."
        self.stdout.write(f"Kept as {scenario.slug}." if scenario else told_last)
