"""Messages to workers, sent on commit: what each row needs, and pictures."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TypeVar

from django.db import transaction
from django.db.models import Model

from augment.errors import QueueFault
from augment.tasks import draw, enqueue_row, send

send_charts = partial(send, draw, "rating")

Row = TypeVar("Row", bound=Model)

_AT_ONCE = 4
"""So many workers draw the pictures of one study."""


def send_on_commit(
    row: Row, tell: Callable[[str], object], send: Callable[[], object] | None = None
) -> None:
    """Send workers what a row needs on commit.

    Args:
        row: Just written.
        tell: Gets the text of a fault of the queue; the row waits then.
        send: What is sent; by default what its kind needs.
    """

    def send_now() -> None:
        try:
            (send or partial(enqueue_row, row))()
        except QueueFault as error:
            tell(str(error))

    transaction.on_commit(send_now)


def send_pictures(study_pk: int) -> None:
    """Have the pictures of a study's pairs drawn that are missing, once all is stored.

    Without a broker they wait for the next look at the study, by its admins or a voter.
    """

    def send_all() -> None:
        with suppress(QueueFault):
            for _ in range(_AT_ONCE):
                send(draw, "study", study_pk)

    transaction.on_commit(send_all)
