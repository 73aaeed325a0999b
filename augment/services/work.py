"""Leases on rows of work: taken, kept by a heartbeat, settled with an outcome, or given back.

In: the key of a `Work` row, by a message that may come twice or never. Out: its outcome. One
conditional UPDATE decides who works on a row, never a message. A lease without a heartbeat is
taken back, so that the row waits again. All times are the database's, so that workers whose clocks
differ judge a lease alike.
"""

from __future__ import annotations

import logging
import sqlite3
import time
import uuid
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from datetime import timedelta
from enum import StrEnum
from functools import partial
from threading import Event
from typing import Any, Generic, TypeVar

from django.conf import settings
from django.db import Error, OperationalError, connection, transaction
from django.db.models import Q, QuerySet

from augment import errors
from augment.llm.messages import shorten
from augment.models import FAILED, Work
from augment.services.clock import DATABASE_TIME, Moment, repeating
from augment.services.texts import LONGEST_REASON, make_storable

logger = logging.getLogger(__name__)

Row = TypeVar("Row", bound=Work)
Result = TypeVar("Result")

FIRST_WAIT_S, LONGEST_WAIT_S = 0.05, 1.0
"""Between looks at what others hold: a locked database, room for a call, its answer."""

PATIENCE_S = 600.0
"""How long a database that takes nothing is waited for."""

CANCELLED = "cancelled"
"""The state of work that nobody needs any more, of the kinds that have it."""

FREE: Mapping[str, Any] = {"claim": None, "heartbeat_at": None}


class TryEnd(StrEnum):
    """End of a worker's try beside the outcomes of its row."""

    LOST = "lost"
    RELEASED = "released"
    STOPPED = "stopped at cap"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settlement:
    """Result of settling a row.

    Attributes:
        state: One that is not under way.
        reason: Why there is no result, as a sentence; empty where there is one.
        columns: What else is written.
    """

    state: str
    reason: str = ""
    columns: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lease(Generic[Row]):
    """The right to write one row, as long as it carries the token.

    Attributes:
        attempt: What `on_start` of its kind returned.
    """

    kind: WorkKind[Row]
    pk: int
    token: uuid.UUID
    attempt: Any = field(default=None, repr=False, compare=False)
    _is_lost: Event = field(default_factory=Event, repr=False, compare=False)

    @property
    def row(self) -> QuerySet[Row]:
        """The row, if it is still the holder's."""
        return self.kind.rows.filter(pk=self.pk, claim=self.token)

    def renew(self, *, now: Moment = DATABASE_TIME) -> bool:
        """Record a heartbeat; False when the lease is lost."""
        return bool(self.row.update(heartbeat_at=now))

    def is_held(self, *, lock: bool = False) -> bool:
        """Return whether the row still carries the token; `lock` keeps it for the transaction."""
        if lock:
            return self.row.select_for_update().values_list("pk").first() is not None
        return self.row.exists()

    def insist(self) -> None:
        """Raise LeaseLost if a heartbeat has found the lease taken back; asks no database."""
        if self._is_lost.is_set():
            raise errors.LeaseLost

    def note(self, **columns: Any) -> None:
        """Write what is known before the outcome.

        Raises:
            LeaseLost: Another worker has the row now.
        """
        if not self.row.update(**columns):
            raise errors.LeaseLost

    @transaction.atomic
    def settle(self, outcome: Settlement, *, now: Moment = DATABASE_TIME) -> bool:
        """Write the outcome; False when the lease is lost, and then nothing is written."""
        reason = shorten(make_storable(outcome.reason), LONGEST_REASON)
        ended = {"state": outcome.state, "reason": reason, "finished_at": now, "lost": 0, **FREE}
        if not self.row.update(**ended, **outcome.columns):
            logger.warning("Dropped the result of %s: its lease was taken back.", self)
            return False
        self.kind.on_finish(self.pk, outcome.state, reason, now)
        return True

    @transaction.atomic
    def release(
        self, *, now: Moment = DATABASE_TIME, end: TryEnd = TryEnd.RELEASED, reason: str = ""
    ) -> bool:
        """Let the unfinished row wait again; False when the lease is lost already."""
        again = {**self.kind.model.GIVEN_BACK, **FREE, "sent_at": None, "lost": 0}
        if not self.row.update(**again):
            return False
        self.kind.on_finish(self.pk, end, shorten(make_storable(reason), LONGEST_REASON), now)
        return True

    def keep_alive(self) -> AbstractContextManager[None]:
        """Send heartbeats until the block is left, or until the lease is lost."""
        return repeating(self._beat, every_s=settings.HEARTBEAT_S, name="heartbeat")

    def _beat(self) -> bool:
        """Renew once; a database that can't take it now gets the next heartbeat."""
        try:
            is_ours = self.renew()
        except Error as error:
            logger.warning("No heartbeat for %s: %s", self, error)
            connection.close()
            return True
        if not is_ours:
            self._is_lost.set()
            logger.warning("%s is somebody else's now.", self)
        return is_ours

    def __str__(self) -> str:
        return f"{self.kind.name} {self.pk}"


class WorkKind(ABC, Generic[Row]):
    """One kind of work: its rows, what is done with one, and the machine that all kinds share.

    Attributes:
        model: The rows.
        queue: Where its messages wait.
        priority: 0 for what somebody waits for, which is taken first; up to 9.
        lost_limit: So many workers in a row may be lost over one row; then it fails, so that no
            row kills one worker after the other.
        related: What is read together with a row.
    """

    model: type[Row]
    queue = "drawing"
    priority = 0
    lost_limit = 2
    related: tuple[str, ...] = ()

    # --- What a kind says of itself ---

    @abstractmethod
    def run(self, row: Row, held: Lease[Row]) -> Settlement | None:
        """Do the work. Returns the outcome; None where it is written already.

        Raises:
            AugmentError: Why the row fails.
            JobCancelled: Nobody needs it any more; it is cancelled.
            LeaseLost: Another worker has the row now.
            WorkerStopping, BudgetSpent: Nothing more is done now; the row waits again.
        """

    def waiting(self) -> QuerySet[Row]:
        """Return the rows that may be taken."""
        return self.rows.filter(state__in=self.model.UNDER_WAY, claim=None)

    def sendable(self) -> QuerySet[Row]:
        """Return the waiting rows for which messages are sent."""
        return self.waiting()

    def columns(self, row: Row) -> Mapping[str, Any]:
        """Return the columns that are written with every outcome."""
        return {}

    def on_start(self, pk: int, worker: str, now: Moment) -> object:
        """Note that a worker has taken a row, in the same transaction; returns the note."""
        return None

    def on_finish(self, pk: int, end: str, reason: str, now: Moment) -> None:
        """Note how a try ended: with an outcome or a TryEnd; in the same transaction."""

    def after_commit(self, row: Row, outcome: Settlement | None) -> None:
        """Follow up a try, whose outcome is committed if there is one."""

    def outcome_of_loss(self, row: Row) -> Settlement | None:
        """Return the outcome of a row that has lost its worker; None where it waits again."""
        if row.lost + 1 < self.lost_limit:
            return None
        if self.lost_limit == 1:
            return Settlement(state=FAILED, reason="Its worker was lost; start it again.")
        lost = f"Lost {row.lost + 1} workers in a row at this one"
        return Settlement(state=FAILED, reason=f"{lost}; look for the cause, then retry.")

    def find_unblocked(self, pk: int) -> list[int]:
        """Return the waiting rows that could not be taken before that one had its outcome."""
        return []

    def cleanup(self, now: Moment) -> None:
        """Clean up what else a lost worker may leave behind."""

    # --- What all kinds share ---

    @property
    def name(self) -> str:
        """As messages and logs say it."""
        return str(self.model._meta.model_name)

    @property
    def rows(self) -> QuerySet[Row]:
        """All of them."""
        return self.model._default_manager.all()

    @transaction.atomic
    def take(self, pk: int, *, now: Moment = DATABASE_TIME, worker: str = "") -> Lease[Row] | None:
        """Take a waiting row.

        Returns:
            The lease, or None where the row does not wait (any more): a second delivery of a
            message does nothing therefore.
        """
        token = uuid.uuid4()
        taken = {**self.model.STARTED, "claim": token, "heartbeat_at": now, "finished_at": None}
        if not self.waiting().filter(pk=pk).update(**taken):
            return None
        return Lease(kind=self, pk=pk, token=token, attempt=self.on_start(pk, worker, now))

    def perform(self, pk: int, *, worker: str = "") -> bool:
        """Take a row and work on it, anew where the database was locked.

        Returns:
            Whether it could be taken.
        """
        give_up_at = time.monotonic() + PATIENCE_S
        is_taken = False
        while lease := wait_out(partial(self.take, pk, worker=worker)):
            is_taken = True
            if self.work(lease) or time.monotonic() > give_up_at:
                break
        return is_taken

    def work(self, held: Lease[Row]) -> bool:
        """Work on a row that was taken; however the work ends, the row is settled or given back.

        An error with a sentence fails the row with it, an unforeseen one with its class and text.
        A worker that shuts down (WorkerStopping, SystemExit, KeyboardInterrupt) gives the row
        back, and so does one whose job has no room for the next call. A lost lease ends quietly:
        the new holder brings the outcome. A locked database is no outcome: the row is given back.

        Returns:
            Whether nothing but another message is left to do; False where the database was locked.
        """
        row = self.rows.select_related(*self.related).get(pk=held.pk)
        settled = None
        try:
            with held.keep_alive():
                outcome = self._try(row, held)
                if outcome is not None and wait_out(partial(held.settle, outcome)):
                    settled = outcome
        except errors.LeaseLost as error:
            logger.warning("Stopped work on %s: %s", held, error)
        except errors.WorkerStopping as error:
            logger.info("Gave %s back: %s.", held, error)
            held.release(reason=str(error))
        except errors.BudgetSpent as error:
            held.release(end=TryEnd.STOPPED, reason=str(error))
        except Exception as error:
            if isinstance(error, errors.DatabaseLocked) or is_passing(error):
                logger.warning("Gave %s back: %s", held, error)
                wait_out(partial(held.release, reason=f"The database was locked: {error}"))
                return False
            logger.exception("Work on %s broke.", held)
            held.settle(Settlement(state=FAILED, reason=reason_sentence(error)))
        except BaseException:
            held.release()
            raise
        finally:
            wait_out(partial(self.after_commit, row, settled))
        return True

    def _try(self, row: Row, held: Lease[Row]) -> Settlement | None:
        """Run; what went wrong with a sentence is an outcome as well."""
        try:
            outcome = self.run(row, held)
        except (errors.LeaseLost, errors.WorkerStopping, errors.BudgetSpent):
            raise
        except errors.AugmentError as error:
            state = CANCELLED if isinstance(error, errors.JobCancelled) else FAILED
            outcome = Settlement(state=state, reason=reason_sentence(error))
        return outcome and replace(outcome, columns={**self.columns(row), **outcome.columns})

    def take_back_lost(self, *, now: Moment = DATABASE_TIME) -> list[int]:
        """Take back every lease that has gone silent; returns the rows that wait again."""
        return [row.pk for row in self._silent(now) if self._take_back(row, now)]

    def find_unsent(
        self, *, older_than: timedelta, now: Moment = DATABASE_TIME, only: Q | None = None
    ) -> list[int]:
        """Return waiting rows without a message, or with one that old."""
        is_lost = Q(sent_at=None) | Q(sent_at__lte=now - older_than)
        unsent = self.sendable().filter(is_lost, only or Q())
        return list(unsent.order_by("pk").values_list("pk", flat=True))

    def mark_sent(self, pks: Iterable[int], *, now: Moment = DATABASE_TIME) -> None:
        """Remember when the messages of these rows were sent."""
        change_all(self.rows.filter(pk__in=list(pks)), sent_at=now)

    def _silent(self, now: Moment) -> QuerySet[Row]:
        """Return rows whose holders have not been heard for too long."""
        since = now - timedelta(seconds=settings.STALE_AFTER_S)
        return self.rows.filter(claim__isnull=False, heartbeat_at__lt=since)

    @transaction.atomic
    def _take_back(self, seen: Row, now: Moment) -> bool:
        """End a silent lease, unless its holder was heard since; True when the row waits again."""
        outcome = self.outcome_of_loss(seen)
        changes: dict[str, Any] = {**self.model.GIVEN_BACK, "sent_at": None, "lost": seen.lost + 1}
        if outcome is not None:
            changes = {"state": outcome.state, "finished_at": now, "lost": 0, **outcome.columns}
            changes |= {"reason": outcome.reason}
        row = self._silent(now).filter(pk=seen.pk, claim=seen.claim)
        if not row.update(**FREE, **changes):
            return False
        self.on_finish(seen.pk, TryEnd.LOST, "The worker stopped without a word.", now)
        logger.warning("Took back %s %d: silent since %s.", self.name, seen.pk, seen.heartbeat_at)
        return outcome is None


KINDS: dict[str, WorkKind[Any]] = {}
"""Every kind by its name, as far as this process has loaded them."""


def register(*kinds: WorkKind[Any]) -> None:
    """Let workers take these kinds, and recover what is lost of them."""
    KINDS.update({kind.name: kind for kind in kinds})


def reason_sentence(error: Exception) -> str:
    """Return the reason of a failure, with the HTTP status if there was one.

    What is no fault of ours with a sentence is told by its class as well.
    """
    if not isinstance(error, errors.AugmentError):
        return f"unexpected: {type(error).__name__}: {error}"
    text, status = str(error), getattr(error, "status", None)
    return text if status is None or str(status) in text else f"HTTP {status}: {text}"


def is_passing(error: Exception) -> bool:
    """Return whether the same may succeed later: a lock, a deadlock, a full disk, no connection.

    SQLite reports a statement that is wrong by the same class.
    """
    code = getattr(error.__cause__, "sqlite_errorcode", None)
    return isinstance(error, OperationalError) and code != sqlite3.SQLITE_ERROR


def wait_out(act: Callable[[], Result], *, sleep: Callable[[float], None] = time.sleep) -> Result:
    """Return the transaction's result, tried again for as long as the database is locked.

    Raises:
        DatabaseLocked: It took nothing for PATIENCE_S.
    """
    wait_s, waited_s = FIRST_WAIT_S, 0.0
    while True:
        try:
            return act()
        except OperationalError as error:
            if not is_passing(error):
                raise
            if waited_s >= PATIENCE_S:
                raise errors.DatabaseLocked(
                    f"The database was locked for too long: {error}."
                ) from error
            logger.warning("The database takes nothing yet, trying again: %s", error)
            if not connection.in_atomic_block:
                connection.close_if_unusable_or_obsolete()
        sleep(wait_s)
        waited_s += wait_s
        wait_s = min(1.5 * wait_s, LONGEST_WAIT_S)


@transaction.atomic
def change_all(rows: QuerySet[Any], **changes: Any) -> int:
    """Write the same columns into many rows; returns how many there were.

    Rows are locked in the order of their keys, so that two writers of the same rows never
    deadlock: a plain UPDATE takes them as they lie. A caller that also changes their job does so
    afterwards, as one that settles a single row does.
    """
    locked = rows.order_by("pk").select_for_update(no_key=True)
    list(locked.values_list("pk", flat=True))
    return rows.update(**changes)
