"""Launch a generation job and, on demand, wait for its end."""

from dataclasses import replace
from functools import partial
from typing import Any

from django.core.management.base import CommandParser
from django.utils import timezone

from augment.management.waiting import WAITING, keep_and_enqueue, wait_if_asked
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.inputs import add_options, read_request, to_inputs
from augment.services.running import choosing, estimates, jobs
from augment.services.running.progress import count_rows
from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """generate --contestants A B --scenarios X Y [--cap-usd N] [--wait]."""

    help = (
        "Run contestants on scenarios; workers do it, `manage.py serve` starts them. "
        "--contestants takes slugs or all; --scenarios slugs, patterns such as 'interplan-*', "
        "all, catalogue, set:paper, set:hard or paraphrases."
    )

    def add_arguments(self, parser: CommandParser) -> None:
        """Add the contestants, the scenarios, and whether to wait."""
        for field in to_inputs(jobs.JobRequest):
            add_options(parser, [replace(field, default="") if field.name == "name" else field])
        parser.add_argument(
            "--estimate", action="store_true", help="say what it would use, and launch nothing"
        )
        for name, arguments in WAITING.items():
            parser.add_argument(name, **arguments)

    def handle(self, *args: Any, **options: Any) -> None:
        """Launch the job, then wait if asked to."""
        ensure_builtin()
        values = options | {
            "name": options["name"] or f"Job of {timezone.now():%Y-%m-%d %H:%M} UTC",
            "contestants": choosing.resolve_contestants(options["contestants"]),
            "scenarios": resolve_scenarios(options["scenarios"]),
        }
        request = read_request(jobs.JobRequest, values)
        if options["estimate"]:
            self._say(estimates.estimate(request))
            return
        job = keep_and_enqueue(partial(jobs.launch, request))
        self.stdout.write(f"Job {job.code}, {job.name!r}: {count_rows(job).total} to run.")
        wait_if_asked(self, job, options)

    def _say(self, expected: estimates.JobEstimate) -> None:
        self.stdout.write(f"{expected.rows} to run, {expected.asking_rows} of them ask models.")
        for line in expected.lines:
            self.stdout.write(f"{line.slug}: {_use(line)} ({line.seen} earlier runs)")
        if len(expected.lines) > 1:
            self.stdout.write(f"In all: {_use(expected)}, {len(expected.unpriced)} unknown")


def _use(expected: estimates.JobEstimate | estimates.ContestantEstimate) -> str:
    least, usual, most = expected.calls
    if expected.usd is None:
        return f"calls {usual} expected ({least} to {most}), cost unknown"
    return (
        f"calls {usual} expected ({least} to {most}), tokens {expected.tokens_in} in, "
        f"{expected.tokens_out} out, {expected.usd:.4f} USD"
    )
