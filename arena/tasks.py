"""Celery tasks of arena: doors that carry one id.

Rows are the truth. A message may come twice (a ready rating is not computed again) or never (the
page of a rating that waits offers to send it once more).
"""

from __future__ import annotations

from celery import current_app, shared_task

from arena.services import ratings
from augment.errors import QueueUnreachable


@shared_task(name="arena.compute_snapshot", acks_late=True, ignore_result=True)
def compute_snapshot(snapshot_pk: int) -> None:
    """Compute a planned rating, unless it is ready already."""
    ratings.compute_snapshot(snapshot_pk=snapshot_pk)


def send_snapshot(snapshot_pk: int) -> None:
    """Ask a worker to compute a planned rating; for transaction.on_commit.

    Raises:
        QueueUnreachable: No broker; the rating waits until it is sent again.
    """
    with current_app.connection_for_write() as broker:
        try:
            broker.ensure_connection(max_retries=1, interval_start=0, timeout=5)
            compute_snapshot.apply_async((snapshot_pk,), connection=broker, retry=False)
        except compute_snapshot.OperationalError as error:
            raise QueueUnreachable(broker.as_uri()) from error
