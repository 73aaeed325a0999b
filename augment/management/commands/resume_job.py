"""Let a job that is paused or stopped at its cap go on."""

from typing import Any

from django.db import transaction

from augment.services.inputs import read_request
from augment.services.running.budget import Caps, describe_caps
from augment.services.running.choosing import find_job
from augment.services.running.jobs import resume
from augment.services.running.progress import count_rows
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_job


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
        job = find_job(options["job"])
        check_broker()
        with transaction.atomic():
            resume(job, higher=read_request(Caps, options))
            transaction.on_commit(lambda: enqueue_job(job.pk))
        waiting = count_rows(job).queued
        self.stdout.write(f"Job {job.code}, capped at {describe_caps(job)}: {waiting} to run.")
