"""Have a language model change its own answer further, and on demand wait for it."""

from typing import Any

from django.db import transaction

from augment.management.waiting import WAITING, wait_if_asked
from augment.services.inputs import read_request
from augment.services.running.follow_ups import FollowUpRequest, ask_follow_up, find_augmentation
from augment.services.terminal import TerminalCommand
from augment.tasks import check_broker, enqueue_augmentation


class Command(TerminalCommand):
    """follow_up AUGMENTATION "A bit further left." [--cap-usd N] [--wait]."""

    help = (
        "Tell a contestant that is a language model what to change in its own answer; its code "
        "is the one in the address of its page. To go back, follow up an earlier step."
    )

    arguments = {"augmentation": {"help": "the code of the answer"}, **WAITING}
    request = FollowUpRequest

    def handle(self, *args: Any, **options: Any) -> None:
        """Ask, then wait if asked to."""
        answer = find_augmentation(options["augmentation"])
        check_broker()
        with transaction.atomic():
            row = ask_follow_up(answer, read_request(FollowUpRequest, options))
            transaction.on_commit(lambda: enqueue_augmentation(row.pk))
        self.stdout.write(f"Augmentation {row.code} of {row.scenario.slug} waits.")
        wait_if_asked(self, row.job, options)
