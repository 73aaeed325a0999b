"""Launch a generation job and, on demand, wait for its end."""

from __future__ import annotations

import time
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError
from django.db import transaction
from django.utils import timezone

from augment.broker import check_broker
from augment.formats.documents import read_yaml_file
from augment.management.arguments import add_cap_arguments, caps_of
from augment.models import Augmentation, GenerationJob
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.running import jobs
from augment.services.running.budget import limit_of
from augment.services.running.choosing import resolve_contestants, resolve_scenarios
from augment.services.running.estimates import estimate
from augment.services.running.matrix import WHAT, Matrix, load_matrix
from augment.services.running.progress import (
    JobCounts,
    contestant_lines,
    count_rows,
    failure_groups,
)
from augment.services.terminal import TerminalCommand
from augment.tasks import enqueue_job

POLL_S = 0.5
HINT_AFTER_S = 10.0
BAR_CELLS = 30
STOPPED = 3
"""Exit code of a wait that a cap, or somebody who paused the job, has ended."""


class Command(TerminalCommand):
    """generate --contestants A B --scenarios X Y | --matrix FILE [--cap USD] [--wait]."""

    help = "Run contestants on scenarios; workers do it, `manage.py serve` starts them."

    def add_arguments(self, parser: ArgumentParser) -> None:
        """What to run, and whether to wait."""
        parser.add_argument(
            "--matrix",
            type=Path,
            metavar="FILE",
            help="YAML with models x variants x options, scenarios and samples instead of the "
            "arguments for these; checked as a whole before anything runs",
        )
        parser.add_argument("--contestants", nargs="+", help="slugs, or all")
        parser.add_argument(
            "--scenarios",
            nargs="+",
            help="slugs, patterns such as 'interplan-*', or all, catalogue, set:paper, set:hard, "
            "paraphrases",
        )
        parser.add_argument("--name", help="what people call the job")
        parser.add_argument(
            "--samples",
            type=int,
            metavar="K",
            help="ask every contestant K times about every scenario; default: 1",
        )
        add_cap_arguments(parser)
        parser.add_argument(
            "--fresh", action="store_true", help="ask anew what models answered in other jobs"
        )
        parser.add_argument(
            "--estimate",
            "--dry-run",
            action="store_true",
            help="say what it would use, and launch and keep nothing",
        )
        parser.add_argument("--wait", action="store_true", help="stay until the job is over")
        parser.add_argument(
            "--timeout", type=float, default=3600.0, help="seconds to wait at most"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Launch the job, then wait if asked to."""
        _refuse_both(options)
        if options["estimate"]:
            with transaction.atomic():
                self._estimate(options)
                transaction.set_rollback(True)
            return
        check_broker()
        job = self._launch(options)
        total = count_rows(job).total
        self.stdout.write(f"Job {job.code}, {job.name!r}: {total} to run.")
        if options["wait"]:
            try:
                self.wait(job, options["timeout"])
            except KeyboardInterrupt:
                raise CommandError("Not waited for; the job goes on.", returncode=130) from None
            self.report(job)

    def _estimate(self, options: dict[str, Any]) -> None:
        runs = self._runs(options)
        found = estimate(runs.contestants, runs.scenarios, samples=runs.samples)
        for slug in runs.made:
            self.stdout.write(f"Would be added: {slug}.")
        self.stdout.write(f"{found.rows} to run, {found.asking_rows} of them ask models.")
        for line in found.lines:
            least, usual, most = line.calls
            basis = f"{line.seen} earlier runs" if line.seen else "a guess from its prompts"
            money = "cost unknown"
            if line.usd is not None and line.usd_most is not None:
                money = f"{line.usd:.4f} USD expected, {line.usd_most:.2f} at most"
            self.stdout.write(
                f"{line.slug}: calls {usual} expected ({least} to {most}), tokens "
                f"{line.tokens_in} in, {line.tokens_out} out, {money} ({basis})"
            )
        if len(found.lines) > 1:
            least, usual, most = found.calls
            unknown = f", of {len(found.unpriced)} contestants unknown" if found.unpriced else ""
            self.stdout.write(
                f"In all: calls {usual} expected ({least} to {most}), tokens {found.tokens_in} "
                f"in, {found.tokens_out} out, {found.usd:.4f} USD expected, {found.usd_most:.2f} "
                f"at most{unknown}"
            )

    def _launch(self, options: dict[str, Any]) -> GenerationJob:
        with transaction.atomic():
            runs = self._runs(options)
            usual = f"Job of {timezone.now():%Y-%m-%d %H:%M} UTC"
            job = jobs.launch(
                name=options["name"] or runs.name or usual,
                contestants=runs.contestants,
                scenarios=runs.scenarios,
                caps=caps_of(options),
                samples=runs.samples,
                is_fresh=options["fresh"],
            )
            transaction.on_commit(lambda: enqueue_job(job.pk))
        return job

    def _runs(self, options: dict[str, Any]) -> Matrix:
        """What is to run, of the file or of the arguments."""
        if options["matrix"] is not None:
            return load_matrix(read_yaml_file(options["matrix"], what=WHAT))
        ensure_builtin()
        return Matrix(
            name=None,
            contestants=tuple(resolve_contestants(options["contestants"])),
            scenarios=tuple(resolve_scenarios(options["scenarios"])),
            samples=1 if options["samples"] is None else options["samples"],
            made=(),
        )

    def wait(self, job: GenerationJob, timeout_s: float) -> None:
        """Show the progress until nothing is under way.

        Raises:
            CommandError: The time is up, or the job stopped at its cap.
        """
        started = time.monotonic()
        shown, hinted = "", False
        while True:
            counts = count_rows(job)
            shown = self._show(counts, shown)
            if not counts.under_way:
                self.stdout.write("" if self.stdout.isatty() else "Over.")
                return
            held = state_held(job)
            if held and not counts.running:
                raise CommandError(_held_sentence(job, held, counts), returncode=STOPPED)
            waited = time.monotonic() - started
            if waited > timeout_s:
                raise CommandError(
                    f"Still under way after {timeout_s:g} s: {counts.queued} wait, "
                    f"{counts.running} run. The job goes on without this command."
                )
            if not hinted and waited > HINT_AFTER_S and counts.queued == counts.total:
                self.stderr.write("No worker has taken anything yet; does `manage.py serve` run?")
                hinted = True
            time.sleep(POLL_S)

    def _show(self, counts: JobCounts, before: str) -> str:
        """A bar that moves on a terminal, elsewhere a line whenever something changed."""
        text = f"{counts.settled} of {counts.total}, {counts.running} running"
        if counts.failed:
            text += f", {counts.failed} failed"
        if text != before:
            if self.stdout.isatty():
                cells = BAR_CELLS * counts.settled // counts.total
                bar = "#" * cells + "." * (BAR_CELLS - cells)
                self.stdout.write(f"[{bar}] {text}   ", ending="\r")
                self.stdout.flush()
            else:
                self.stdout.write(text)
        return text

    def report(self, job: GenerationJob) -> None:
        """The table, the failures by reason, and exit code 1 if there is any."""
        lines = contestant_lines(job)
        width = max(len(line.slug) for line in lines)
        self.stdout.write(f"{'contestant':{max(width, 10)}}  done  unreadable  refused  failed")
        for line in lines:
            self.stdout.write(
                f"{line.slug:{max(width, 10)}}  {line.done:4}  {line.unreadable:10}  "
                f"{line.refused:7}  {line.failed:6}"
            )
        failed = Augmentation.State.FAILED
        failures = [group for group in failure_groups(job) if group.state == failed]
        for group in failures:
            self.stdout.write(
                f"failed {group.number} time{'s' * (group.number > 1)}: {group.reason}"
            )
        if failures:
            number = sum(group.number for group in failures)
            raise CommandError(f"{number} failed; see the reasons above.", returncode=1)


def _refuse_both(options: dict[str, Any]) -> None:
    """Either the file says what runs, or the arguments do.

    Raises:
        CommandError: Both do, or neither.
    """
    arguments = ("contestants", "scenarios", "samples")
    named = [f"--{name}" for name in arguments if options[name] is not None]
    if options["matrix"] is not None and named:
        raise CommandError(f"--matrix says what runs; it goes without {', '.join(named)}.")
    if options["matrix"] is None and not (options["contestants"] and options["scenarios"]):
        raise CommandError("Name --contestants and --scenarios, or --matrix FILE.")


def state_held(job: GenerationJob) -> str:
    """In which state the job waits to be resumed right now; empty where it does not."""
    held = GenerationJob.objects.filter(pk=job.pk, state__in=GenerationJob.HELD)
    return held.values_list("state", flat=True).first() or ""


def _held_sentence(job: GenerationJob, state: str, counts: JobCounts) -> str:
    if state == GenerationJob.State.PAUSED:
        return (
            f"Paused by somebody with {counts.queued} left; `manage.py resume_job {job.code}` "
            "goes on."
        )
    return (
        f"Stopped at its cap of {limit_of(job)} with {counts.queued} left; "
        f"`manage.py resume_job {job.code}` with a higher cap goes on."
    )
