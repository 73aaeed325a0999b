"""Messages to workers about arena's rows; for transaction.on_commit, as `augment.tasks.enqueue`.

They name the kind of a row alone: `arena.tasks`, above all subjects, says what is done with it.
"""

from functools import partial

from augment.services import KINDS
from augment.tasks import draw, enqueue, send


def _enqueue_row(kind: str, pk: int) -> int:
    return enqueue(KINDS[kind], [pk])


send_snapshot = partial(_enqueue_row, "snapshot")
send_benchmark_file = partial(_enqueue_row, "benchmarkfile")
send_scenario_file = partial(_enqueue_row, "scenariofile")
send_study_file = partial(_enqueue_row, "studyfile")
send_charts = partial(send, draw, "rating")
