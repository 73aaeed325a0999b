"""Have a language model change its own answer further, and on demand wait for it."""

from functools import partial
from typing import Any

from augment.management.waiting import WAITING, keep_and_enqueue, wait_if_asked
from augment.services.inputs import read_request
from augment.services.running.follow_ups import FollowUpRequest, ask_follow_up, find_augmentation
from augment.services.terminal import TerminalCommand


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
        request = read_request(FollowUpRequest, options)
        row = keep_and_enqueue(partial(ask_follow_up, answer, request))
        self.stdout.write(f"Augmentation {row.code} of {row.scenario.slug} waits.")
        wait_if_asked(self, row.job, options)
