"""Worker processes: which live, since when nobody recovers lost work, and whether to stop."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from threading import Event, Lock

from django.conf import settings

from augment.errors import WorkerStopping
from augment.models import Worker
from augment.services.clock import DATABASE_TIME
from augment.services.endpoints.known_endpoints import list_keys
from augment.services.texts import make_storable

logger = logging.getLogger(__name__)

KEPT = timedelta(days=7)
"""Workers that have been silent for so long are forgotten, but for the last one."""

FAULT_LENGTH = 300
MOST_HEARD = 200
"""So many of the last heard are looked at; crashed ones leave a row each."""

LATE_ROUNDS = 4
"""A worker whose last good round is so many rounds ago does not recover lost work."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Workforce:
    """State of the workers.

    Attributes:
        living: How many were heard a moment ago.
        silent_since: Where none lives: when the last one ended or was last heard, None where
            there has been none.
        not_recovered_since: Where workers live and none recovers lost work: since when.
        fault: Why they can't, as far as they said so.
        keys: Names of the variables for keys that all living ones have.
    """

    living: int
    silent_since: datetime | None = None
    not_recovered_since: datetime | None = None
    fault: str = ""
    keys: frozenset[str] = frozenset()

    @property
    def works(self) -> bool:
        """True if a worker lives and lost work is recovered."""
        return self.living > 0 and self.not_recovered_since is None


def survive(action: Callable[[], object], complaint: str) -> bool:
    """Do what may break in any way without ending the caller's loop; False with a log line."""
    try:
        action()
    except Exception:
        logger.exception(complaint)
        return False
    return True


class Presence:
    """One worker's row: made when it is first heard, and anew when somebody deleted it.

    Args:
        name: Host and process.
    """

    def __init__(self, name: str) -> None:
        self._name = name[:120]
        self._pk: int | None = None
        self._making = Lock()

    def beat(self) -> None:
        """Record a sign of life."""
        # Two threads of a worker beat; at its start both would make a row, and one never ended.
        with self._making:
            if not self._update(seen_at=DATABASE_TIME):
                old = Worker.objects.filter(seen_at__lt=DATABASE_TIME - KEPT)
                last = Worker.objects.first()
                if last is not None:
                    old.exclude(pk=last.pk).delete()
                times = {"started_at": DATABASE_TIME, "seen_at": DATABASE_TIME}
                row = Worker.objects.create(name=self._name, keys=list_keys(), **times)
                self._pk = row.pk

    def record_recovery(self) -> None:
        """Record that it has recovered what was lost."""
        self.beat()
        self._update(recovered_at=DATABASE_TIME, fault="")

    def record_fault(self, fault: str) -> None:
        """Record why it could not."""
        self.beat()
        self._update(fault=make_storable(fault)[:FAULT_LENGTH] or "unknown")

    def end(self) -> None:
        """Record that it ends in order."""
        self._update(seen_at=DATABASE_TIME, ended_at=DATABASE_TIME)

    def _update(self, **changes: object) -> bool:
        return bool(Worker.objects.filter(pk=self._pk).update(**changes)) if self._pk else False


def do_round(recover: Callable[[], object], presence: Presence) -> bool:
    """Recover lost work once; a fault of any kind is logged, kept for the pages and returned."""
    try:
        recover()
        presence.record_recovery()
    except Exception as error:
        logger.exception("Could not bring lost work back, will try again.")
        fault = str(error) or type(error).__name__
        survive(lambda: presence.record_fault(fault), "This could not be stored for the pages")
        return False
    return True


def workforce() -> Workforce:
    """Return which workers live now, on the database's clock; one query."""
    heard = list(Worker.objects.annotate(now=DATABASE_TIME)[:MOST_HEARD])
    if not heard:
        return Workforce(living=0)
    now: datetime = heard[0].now
    silent_for = timedelta(seconds=settings.STALE_AFTER_S)
    living = [row for row in heard if not row.ended_at and now - row.seen_at <= silent_for]
    if not living:
        return Workforce(living=0, silent_since=heard[0].seen_at)
    keys = frozenset.intersection(*(frozenset(row.keys) for row in living))
    late = now - timedelta(seconds=LATE_ROUNDS * settings.RECOVER_EVERY_S)
    # A new worker is still at its first round.
    worked_at = {row.pk: row.recovered_at or row.started_at for row in living}
    if any(not row.fault and worked_at[row.pk] >= late for row in living):
        return Workforce(living=len(living), keys=keys)
    last = max(living, key=lambda row: worked_at[row.pk])
    since, fault = worked_at[last.pk], last.fault
    return Workforce(living=len(living), not_recovered_since=since, fault=fault, keys=keys)


stopping = Event()
"""Whether this process is to stop: nothing new begins. Safe to set in a signal handler."""


def insist_on_going_on() -> None:
    """Raise WorkerStopping if the process was told to stop."""
    if stopping.is_set():
        raise WorkerStopping("this worker was told to stop")
