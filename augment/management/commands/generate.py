"""Launch a generation job and, on demand, wait for its end."""

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from django.core.management.base import CommandError, CommandParser
from django.db import transaction
from django.utils import timezone

from augment.models import Augmentation, GenerationJob
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.inputs import add_options, inputs_of, read_request
from augment.services.running import jobs
from augment.services.running.budget import limit_of
from augment.services.running.choosing import resolve_contestants
from augment.services.running.estimates import ContestantEstimate, JobEstimate, estimate
from augment.services.running.jobs import JobRequest
from augment.services.running.progress import count_rows, failure_groups
from augment.services.running.workers import workforce
from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_job

POLL_S = 0.5
STOPPED = 3
"""Exit code of a wait that a cap, or somebody who paused the job, has ended."""


class Command(TerminalCommand):
    """generate --contestants A B --scenarios X Y [--cap-usd N] [--wait]."""

    help = (
        "Run contestants on scenarios; workers do it, `manage.py serve` starts them. "
        "--contestants takes slugs or all; --scenarios slugs, patterns such as 'interplan-*', "
        "all, catalogue, set:paper, set:hard or paraphrases."
    )

    def add_arguments(self, parser: CommandParser) -> None:
        """What to run, and whether to wait."""
        for asked in inputs_of(JobRequest):
            add_options(parser, [replace(asked, default="") if asked.name == "name" else asked])
        parser.add_argument(
            "--estimate", action="store_true", help="say what it would use, and launch nothing"
        )
        self.add_waiting(parser)

    def add_waiting(self, parser: CommandParser) -> None:
        """Whether to wait, and how long."""
        parser.add_argument("--wait", action="store_true", help="stay until the job is over")
        parser.add_argument(
            "--timeout", type=float, default=3600.0, help="seconds to wait at most"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Launch the job, then wait if asked to."""
        ensure_builtin()
        given = options | {
            "name": options["name"] or f"Job of {timezone.now():%Y-%m-%d %H:%M} UTC",
            "contestants": resolve_contestants(options["contestants"]),
            "scenarios": resolve_scenarios(options["scenarios"]),
        }
        request = read_request(JobRequest, given)
        if options["estimate"]:
            self._say(estimate(request))
            return
        check_broker()
        with transaction.atomic():
            job = jobs.launch(request)
            transaction.on_commit(lambda: enqueue_job(job.pk))
        self.stdout.write(f"Job {job.code}, {job.name!r}: {count_rows(job).total} to run.")
        self.wait_if_asked(job, options)

    def wait_if_asked(self, job: GenerationJob, options: Mapping[str, Any]) -> None:
        """Stay until the job is over and print its outcomes, where that is wanted."""
        if not options["wait"]:
            return
        try:
            self.wait(job, options["timeout"])
        except KeyboardInterrupt:
            raise CommandError("Not waited for; the job goes on.", returncode=130) from None
        self.report(job)

    def _say(self, expected: JobEstimate) -> None:
        self.stdout.write(f"{expected.rows} to run, {expected.asking_rows} of them ask models.")
        for line in expected.lines:
            self.stdout.write(f"{line.slug}: {_use(line)} ({line.seen} earlier runs)")
        if len(expected.lines) > 1:
            self.stdout.write(f"In all: {_use(expected)}, {len(expected.unpriced)} unknown")

    def wait(self, job: GenerationJob, timeout_s: float) -> None:
        """Show the progress until nothing is under way.

        Raises:
            CommandError: The time is up, or the job was paused or stopped at its cap.
        """
        if not workforce().works:
            self.stderr.write("No worker is at work; `manage.py serve` starts some.")
        ends_at, shown = time.monotonic() + timeout_s, ""
        while True:
            job.refresh_from_db(fields=["state"])
            counts = count_rows(job)
            text = f"{counts.settled} of {counts.total}, {counts.running} running"
            if text != shown:
                self.stdout.write(text)
                shown = text
            if not counts.is_moving:
                break
            if time.monotonic() > ends_at:
                raise CommandError("The time is up; the job goes on without this command.")
            time.sleep(POLL_S)
        if counts.under_way:
            raise CommandError(
                f"{job.get_state_display()} with {counts.queued} left, its cap is "
                f"{limit_of(job)}; `manage.py resume_job {job.code}` goes on.",
                returncode=STOPPED,
            )
        self.stdout.write("Over.")

    def report(self, job: GenerationJob) -> None:
        """Print the outcomes and the causes of failure; exit code 1 if any failed."""
        counts = count_rows(job).by_state
        states = (*Augmentation.SHOWABLE, Augmentation.State.FAILED)
        self.stdout.write(", ".join(f"{counts[state]} {state}" for state in states))
        groups = failure_groups(job)
        failed = [group for group in groups if group.state == Augmentation.State.FAILED]
        for group in failed:
            self.stdout.write(f"failed x {group.number}: {group.reason}")
        if failed:
            number = sum(group.number for group in failed)
            raise CommandError(f"{number} failed; see the reasons above.", returncode=1)


def _use(expected: JobEstimate | ContestantEstimate) -> str:
    least, usual, most = expected.calls
    if expected.usd is None:
        return f"calls {usual} expected ({least} to {most}), cost unknown"
    return (
        f"calls {usual} expected ({least} to {most}), tokens {expected.tokens_in} in, "
        f"{expected.tokens_out} out, {expected.usd:.4f} USD"
    )
