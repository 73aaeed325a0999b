"""What a worker does beside its work: a sign of life, and an outcome even when it crashes."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

from django.db import Error, connection

from augment.errors import BudgetSpent, JobCancelled, LeaseLost, WorkerStopping
from augment.models import Augmentation
from augment.services.repeating import repeating
from augment.services.running import leases

logger = logging.getLogger(__name__)


@contextmanager
def heartbeat(held: leases.Lease, *, every_s: float) -> Iterator[None]:
    """Beat for the lease until the block is left, or until the lease is lost."""
    with repeating(lambda: _beat(held), every_s=every_s, name="heartbeat"):
        yield


class OutcomeOnCrash:
    """Leaves no row hanging when its worker breaks; what broke still travels on, loudly.

    An exception that nobody foresaw fails the row with its class and text. A worker that is told
    to stop (WorkerStopping, SystemExit, KeyboardInterrupt) gives the row back, quietly where it
    foresaw that. So does one whose job has no room for the next call. A row whose job was
    cancelled is cancelled. A lost lease ends quietly as well: the new holder brings the outcome.
    """

    def __init__(self, held: leases.Lease) -> None:
        self._held = held

    def __enter__(self) -> None:
        return None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> bool:
        if isinstance(error, LeaseLost):
            logger.warning(
                "Stopped work on augmentation %d: %s", self._held.augmentation_pk, error
            )
            return True
        if isinstance(error, JobCancelled):
            cancelled = leases.Settlement(state=Augmentation.State.CANCELLED, reason=str(error))
            leases.settle(held=self._held, settlement=cancelled)
            return True
        if isinstance(error, WorkerStopping):
            logger.info("Gave augmentation %d back: %s.", self._held.augmentation_pk, error)
            leases.release(held=self._held, reason=str(error))
            return True
        if isinstance(error, BudgetSpent):
            leases.release(held=self._held, end=leases.TryEnd.STOPPED, reason=str(error))
            return True
        if isinstance(error, Exception):
            reason = f"unexpected: {type(error).__name__}: {error}"
            failed = leases.Settlement(state=Augmentation.State.FAILED, reason=reason)
            leases.settle(held=self._held, settlement=failed)
        elif error is not None:
            leases.release(held=self._held)
        return False


def _beat(held: leases.Lease) -> bool:
    """One beat; a database that can't take it now gets the next one."""
    try:
        is_ours = leases.renew(held=held)
    except Error as error:
        logger.warning("No heartbeat for augmentation %d: %s", held.augmentation_pk, error)
        connection.close()
        return True
    if not is_ours:
        logger.warning("Augmentation %d is somebody else's now.", held.augmentation_pk)
    return is_ours
