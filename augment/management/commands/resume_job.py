"""Let a job that is paused or stopped at its cap go on."""

from argparse import ArgumentParser
from typing import Any

from django.db import transaction

from augment.management.arguments import add_cap_arguments, caps_of
from augment.services.running.budget import limit_of
from augment.services.running.choosing import find_job
from augment.services.running.jobs import resume
from augment.services.running.progress import count_rows
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_job


class Command(TerminalCommand):
    """resume_job JOB [--cap USD] [--cap-calls N] [--cap-tokens N]."""

    help = (
        "Let a job that is paused or stopped at its cap go on with what is left, its caps raised "
        "where they are given. What was answered already is not asked again."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """The job and its new caps."""
        parser.add_argument("job", help="its name or its code")
        add_cap_arguments(parser)

    def handle(self, *args: Any, **options: Any) -> None:
        """Raise what is given, then resume."""
        job = find_job(options["job"])
        check_broker()
        with transaction.atomic():
            resume(job, higher=caps_of(options))
            transaction.on_commit(lambda: enqueue_job(job.pk))
        waiting = count_rows(job).queued
        self.stdout.write(f"Job {job.code}, capped at {limit_of(job)}: {waiting} to run.")
