"""Let a job that is paused or stopped at its cap go on."""

from functools import partial
from typing import Any

from augment.management.waiting import keep_and_enqueue
from augment.services.inputs import read_request
from augment.services.running import choosing, jobs, progress
from augment.services.running.budget import Caps, describe_caps
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """resume_job JOB [--cap-usd N] [--cap-calls N] [--cap-tokens N]."""

    help = (
        "Let a job that is paused or stopped at its cap go on with what is left, its caps raised "
        "where they are given. What was answered already is not asked again."
    )

    arguments = {"job": {"help": "its name or its code"}}
    request = Caps

    def handle(self, *args: Any, **options: Any) -> None:
        """Raise what is given, then resume."""
        job = choosing.find_job(options["job"])
        keep_and_enqueue(partial(jobs.resume, job, higher=read_request(Caps, options)))
        waiting = progress.count_rows(job).queued
        self.stdout.write(f"Job {job.code}, capped at {describe_caps(job)}: {waiting} to run.")
