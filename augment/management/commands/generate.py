"""Launch a generation job and, on demand, wait for its end."""

import time
from argparse import ArgumentParser
from dataclasses import asdict
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError
from django.db import transaction
from django.utils import timezone

from augment.formats.documents import read_yaml_file
from augment.models import Augmentation, GenerationJob
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.inputs import add_options, inputs_of, read_request
from augment.services.running import jobs
from augment.services.running.budget import limit_of
from augment.services.running.choosing import resolve_contestants, resolve_scenarios
from augment.services.running.estimates import ContestantEstimate, JobEstimate, estimate
from augment.services.running.jobs import JobRequest, JobScope
from augment.services.running.matrix import WHAT, Matrix, load_matrix
from augment.services.running.progress import contestant_lines, count_rows, failure_groups
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_job

POLL_S = 0.5
HINT_AFTER_S = 10.0
STOPPED = 3
"""Exit code of a wait that a cap, or somebody who paused the job, has ended."""


class Command(TerminalCommand):
    """generate --contestants A B --scenarios X Y | --matrix FILE [--cap-usd N] [--wait]."""

    help = "Run contestants on scenarios; workers do it, `manage.py serve` starts them."

    def add_arguments(self, parser: ArgumentParser) -> None:
        """What to run, and whether to wait."""
        parser.add_argument(
            "--matrix",
            type=Path,
            metavar="FILE",
            help="YAML with contestants, scenarios and samples instead of the arguments, "
            "as the page of a new job writes it; checked as a whole before anything runs",
        )
        add_options(parser, inputs_of(JobRequest), is_any_required=False)
        parser.add_argument(
            "--estimate",
            "--dry-run",
            dest="estimate",
            action="store_true",
            help="say what it would use, and launch and keep nothing",
        )
        parser.add_argument("--wait", action="store_true", help="stay until the job is over")
        parser.add_argument(
            "--timeout", type=float, default=3600.0, help="seconds to wait at most"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Launch the job, then wait if asked to."""
        named = [f"--{name}" for name in ("contestants", "scenarios", "samples") if options[name]]
        if options["matrix"] is not None and named:
            raise CommandError(f"--matrix says what runs; it goes without {', '.join(named)}.")
        if options["matrix"] is None and not (options["contestants"] and options["scenarios"]):
            raise CommandError("Name --contestants and --scenarios, or --matrix FILE.")
        if options["estimate"]:
            with transaction.atomic():
                matrix = _matrix(options)
                expected = estimate(matrix.scope)
                transaction.set_rollback(True)
            self._say(matrix, expected)
            return
        check_broker()
        with transaction.atomic():
            matrix = _matrix(options)
            name = options["name"] or matrix.name or f"Job of {timezone.now():%Y-%m-%d %H:%M} UTC"
            given = options | asdict(matrix.scope) | {"is_fresh": options["is_fresh"]}
            job = jobs.launch(read_request(JobRequest, given | {"name": name}))
            transaction.on_commit(lambda: enqueue_job(job.pk))
        self.stdout.write(f"Job {job.code}, {job.name!r}: {count_rows(job).total} to run.")
        if options["wait"]:
            try:
                self.wait(job, options["timeout"])
            except KeyboardInterrupt:
                raise CommandError("Not waited for; the job goes on.", returncode=130) from None
            self.report(job)

    def _say(self, matrix: Matrix, expected: JobEstimate) -> None:
        for slug in matrix.made:
            self.stdout.write(f"Would be added: {slug}.")
        self.stdout.write(f"{expected.rows} to run, {expected.asking_rows} of them ask models.")
        for line in expected.lines:
            basis = f"{line.seen} earlier runs" if line.seen else "a guess from its prompts"
            self.stdout.write(f"{line.slug}: {_use(line)} ({basis})")
        if len(expected.lines) > 1:
            number = len(expected.unpriced)
            unknown = f", of {number} contestants unknown" if number else ""
            self.stdout.write(f"In all: {_use(expected)}{unknown}")

    def wait(self, job: GenerationJob, timeout_s: float) -> None:
        """Show the progress until nothing is under way.

        Raises:
            CommandError: The time is up, or the job stopped at its cap.
        """
        started = time.monotonic()
        shown, is_hinted = "", False
        while True:
            job.refresh_from_db(fields=["state"])
            counts = count_rows(job)
            failed = f", {counts.failed} failed" if counts.failed else ""
            text = f"{counts.settled} of {counts.total}, {counts.running} running{failed}"
            if text != shown:
                self.stdout.write(text)
                shown = text
            if not counts.under_way:
                self.stdout.write("Over.")
                return
            if counts.is_held and not counts.running:
                why, how = f"Stopped at its cap of {limit_of(job)}", " with a higher cap"
                if job.state == GenerationJob.State.PAUSED:
                    why, how = "Paused by somebody", ""
                again = f"`manage.py resume_job {job.code}`{how} goes on."
                raise CommandError(f"{why} with {counts.queued} left; {again}", returncode=STOPPED)
            waited_s = time.monotonic() - started
            if waited_s > timeout_s:
                raise CommandError(
                    f"Still under way after {timeout_s:g} s: {counts.queued} wait, "
                    f"{counts.running} run. The job goes on without this command."
                )
            if not is_hinted and waited_s > HINT_AFTER_S and counts.queued == counts.total:
                self.stderr.write("No worker has taken anything yet; does `manage.py serve` run?")
                is_hinted = True
            time.sleep(POLL_S)

    def report(self, job: GenerationJob) -> None:
        """Print the table and the failures by reason; exit code 1 if there is any."""
        lines = contestant_lines(job)
        width = max(10, *(len(line["slug"]) for line in lines))
        self.stdout.write(f"{'contestant':{width}}  done  unreadable  refused  failed")
        row = "{slug:{width}}  {done:4}  {unreadable:10}  {refused:7}  {failed:6}"
        for line in lines:
            self.stdout.write(row.format(**line, width=width))
        failed = Augmentation.State.FAILED
        failures = [group for group in failure_groups(job) if group.state == failed]
        for group in failures:
            times = f"{group.number} time{'s' * (group.number > 1)}"
            self.stdout.write(f"failed {times}: {group.reason}")
        if failures:
            number = sum(group.number for group in failures)
            raise CommandError(f"{number} failed; see the reasons above.", returncode=1)


def _matrix(options: dict[str, Any]) -> Matrix:
    """Return what is to run, of the file or of the arguments."""
    if options["matrix"] is not None:
        return load_matrix(read_yaml_file(options["matrix"], what=WHAT))
    ensure_builtin()
    scope = read_request(
        JobScope,
        options
        | {
            "contestants": resolve_contestants(options["contestants"]),
            "scenarios": resolve_scenarios(options["scenarios"]),
        },
    )
    return Matrix(name="", scope=scope, made=())


def _use(expected: JobEstimate | ContestantEstimate) -> str:
    least, usual, most = expected.calls
    money = "cost unknown"
    if expected.usd is not None and expected.usd_most is not None:
        money = f"{expected.usd:.4f} USD expected, {expected.usd_most:.2f} at most"
    return (
        f"calls {usual} expected ({least} to {most}), tokens {expected.tokens_in} in, "
        f"{expected.tokens_out} out, {money}"
    )
