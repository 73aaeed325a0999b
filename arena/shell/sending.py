"""Messages to workers about arena's rows; for transaction.on_commit, as `augment.tasks.enqueue`.

They name the kind of a row alone: `arena.tasks`, above all subjects, says what is done with it.
"""

from contextlib import suppress
from functools import partial

from django.db import transaction

from augment.errors import QueueFault
from augment.services import KINDS
from augment.tasks import draw, enqueue, send


def _enqueue_row(kind: str, pk: int) -> int:
    return enqueue(KINDS[kind], [pk])


send_snapshot = partial(_enqueue_row, "snapshot")
send_benchmark_file = partial(_enqueue_row, "benchmarkfile")
send_scenario_file = partial(_enqueue_row, "scenariofile")
send_study_file = partial(_enqueue_row, "studyfile")
send_charts = partial(send, draw, "rating")

_AT_ONCE = 4
"""So many workers draw the pictures of one study."""


def send_pictures(study_pk: int) -> None:
    """Have the pictures of a study's pairs drawn that are missing, once all is stored.

    Without a broker they wait for the next look at the study, by its admins or a voter.
    """

    def send_all() -> None:
        with suppress(QueueFault):
            for _ in range(_AT_ONCE):
                send(draw, "study", study_pk)

    transaction.on_commit(send_all)
