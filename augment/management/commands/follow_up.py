"""Have a language model change its own answer further, and on demand wait for it."""

from typing import Any

from django.core.management.base import CommandParser
from django.db import transaction

from augment.management.commands import generate
from augment.services.inputs import add_options, inputs_of, read_request
from augment.services.running.follow_ups import FollowUpRequest, ask_follow_up, find_augmentation
from augment.tasks import check_broker, enqueue_augmentation


class Command(generate.Command):
    """follow_up AUGMENTATION "A bit further left." [--cap-usd N] [--wait]."""

    help = (
        "Tell a contestant that is a language model what to change in its own answer; its code "
        "is the one in the address of its page. To go back, follow up an earlier step."
    )

    def add_arguments(self, parser: CommandParser) -> None:
        """Which answer, what to change, and whether to wait."""
        parser.add_argument("augmentation", help="the code of the answer")
        add_options(parser, inputs_of(FollowUpRequest))
        self.add_waiting(parser)

    def handle(self, *args: Any, **options: Any) -> None:
        """Ask, then wait if asked to."""
        answer = find_augmentation(options["augmentation"])
        check_broker()
        with transaction.atomic():
            row = ask_follow_up(answer, read_request(FollowUpRequest, options))
            transaction.on_commit(lambda: enqueue_augmentation(row.pk))
        self.stdout.write(f"Augmentation {row.code} of {row.scenario.slug} waits.")
        self.wait_if_asked(row.job, options)
