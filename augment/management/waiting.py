"""Jobs on the command line: launched and waited for."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

from django.core.management.base import CommandError
from django.db import transaction
from django.db.models import Model

from augment.models import Augmentation, GenerationJob
from augment.services.running import budget, progress, workers
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_row

Row = TypeVar("Row", bound=Model)

POLL_S = 0.5
STOPPED = 3
"""Exit code of a wait that a cap, or somebody who paused the job, has ended."""

WAITING: Mapping[str, Mapping[str, Any]] = {
    "--wait": {"action": "store_true", "help": "stay until the job is over"},
    "--timeout": {"type": float, "default": 3600.0, "help": "seconds to wait at most"},
}
"""The options of a command that may wait."""


def keep_and_enqueue(keep: Callable[[], Row]) -> Row:
    """Write a row in a transaction, and send its work once that is committed.

    Raises:
        QueueFault: No broker, or it refuses; nothing is written.
    """
    check_broker()
    with transaction.atomic():
        row = keep()
        transaction.on_commit(partial(enqueue_row, row))
    return row


def wait_if_asked(
    command: TerminalCommand, job: GenerationJob, options: Mapping[str, Any]
) -> None:
    """Stay until the job is over and print its outcomes, where that is wanted."""
    if not options["wait"]:
        return
    try:
        wait(command, job, options["timeout"])
    except KeyboardInterrupt:
        raise CommandError("Not waited for; the job goes on.", returncode=130) from None
    report(command, job)


def wait(command: TerminalCommand, job: GenerationJob, timeout_s: float) -> None:
    """Show the progress until nothing is under way.

    Raises:
        CommandError: The time is up, or the job was paused or stopped at its cap.
    """
    if not workers.workforce().works:
        command.stderr.write("No worker is at work; `manage.py serve` starts some.")
    ends_at, shown = time.monotonic() + timeout_s, ""
    while True:
        job.refresh_from_db(fields=["state"])
        counts = progress.count_rows(job)
        text = f"{counts.settled} of {counts.total}, {counts.running} running"
        if text != shown:
            command.stdout.write(text)
            shown = text
        if not counts.is_moving:
            break
        if time.monotonic() > ends_at:
            raise CommandError("The time is up; the job goes on without this command.")
        time.sleep(POLL_S)
    if counts.under_way:
        raise CommandError(
            f"{job.get_state_display()} with {counts.queued} left, its cap is "
            f"{budget.describe_caps(job)}; `manage.py resume_job {job.code}` goes on.",
            returncode=STOPPED,
        )
    command.stdout.write("Over.")


def report(command: TerminalCommand, job: GenerationJob) -> None:
    """Print the outcomes and the causes of failure; exit code 1 if any failed."""
    counts = progress.count_rows(job).by_state
    states = (*Augmentation.SHOWABLE, Augmentation.State.FAILED)
    command.stdout.write(", ".join(f"{counts[state]} {state}" for state in states))
    groups = progress.failure_groups(job)
    failed = [group for group in groups if group.state == Augmentation.State.FAILED]
    for group in failed:
        command.stdout.write(f"failed x {group.number}: {group.reason}")
    if failed:
        number = sum(group.number for group in failed)
        raise CommandError(f"{number} failed; see the reasons above.", returncode=1)
