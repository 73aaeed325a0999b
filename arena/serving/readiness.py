"""Health checks of the database, the broker and the workers, for load balancers and operators."""

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from django.conf import settings
from django.db import DatabaseError, connection
from django.db.migrations.executor import MigrationExecutor

from augment.errors import QueueFault
from augment.services.running.workers import workforce
from augment.tasks import check_broker

BROKER_WITHIN_S = 1.0
HELD_FOR_S = 5.0
"""Probes need no account, so a request must stay cheap."""

_is_prepared = threading.Event()
"""Set once every migration was seen applied: they don't go away under a running process."""


@dataclass(frozen=True, slots=True)
class PartState:
    """One part: a word that says nothing about the inside, and a detail for who runs it."""

    name: str
    is_ok: bool
    state: str
    detail: str = ""


def look_at_database() -> PartState:
    """Return whether the database answers and has the tables of this release."""
    try:
        missing = [] if _is_prepared.is_set() else find_unapplied_migrations()
        with connection.cursor() as cursor:
            cursor.execute("SELECT 1")
    except DatabaseError as error:
        return PartState("database", False, "unreachable", str(error))
    if missing:
        return PartState("database", False, "unprepared", f"not applied: {', '.join(missing)}")
    _is_prepared.set()
    return PartState("database", True, "ok")


def find_unapplied_migrations() -> list[str]:
    """The migrations of this release that the database lacks, as app.name."""
    executor = MigrationExecutor(connection)
    plan = executor.migration_plan(executor.loader.graph.leaf_nodes())
    return [f"{migration.app_label}.{migration.name}" for migration, _ in plan]


def look_at_broker() -> PartState:
    """Return whether messages to workers can be sent."""
    try:
        check_broker(within_s=BROKER_WITHIN_S)
    except QueueFault as error:
        return PartState("broker", False, "unreachable", str(error))
    return PartState("broker", True, "ok")


def look_at_workers() -> PartState:
    """Return whether at least one worker is alive and lost work is recovered."""
    try:
        found = workforce()
    except DatabaseError as error:
        return PartState("workers", False, "unknown", str(error))
    if not found.living:
        since = f"since {found.silent_since:%Y-%m-%d %H:%M:%S} UTC" if found.silent_since else ""
        return PartState("workers", False, "none", f"no worker is running {since}".strip())
    if not found.works:
        return PartState(
            "workers", False, "stuck", f"lost work is not brought back: {found.fault}"
        )
    return PartState("workers", True, "ok", f"{found.living} running")


class HeldLook:
    """A check whose result is cached for a while, so that many callers cost no more than one.

    Args:
        look: The check.
        for_s: How long a result is cached, in seconds.
        clock: A monotonic clock in seconds.
    """

    def __init__(
        self,
        look: Callable[[], PartState],
        *,
        for_s: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._look, self._for_s, self._clock = look, for_s, clock
        self._lock = threading.Lock()
        self._held: tuple[float, PartState] | None = None

    def __call__(self) -> PartState:
        """Return the result, at most `for_s` old; concurrent callers share one check."""
        with self._lock:
            if self._held is None or self._clock() - self._held[0] >= self._for_s:
                state = self._look()
                self._held = self._clock(), state
            return self._held[1]

    def forget(self) -> None:
        """Drop the cached result."""
        with self._lock:
            self._held = None


HELD = (HeldLook(look_at_broker, for_s=HELD_FOR_S), HeldLook(look_at_workers, for_s=HELD_FOR_S))
PARTS: tuple[Callable[[], PartState], ...] = (look_at_database, *HELD)


def look_at_parts() -> tuple[PartState, ...]:
    """Return the state of every part, in the order of their dependencies."""
    return tuple(look() for look in PARTS)


def opens_metrics(authorization: str | None) -> bool:
    """Return whether a header bears the configured metrics token; False without a token."""
    expected = settings.METRICS_TOKEN
    scheme, _, given = (authorization or "").partition(" ")
    is_bearer = scheme.lower() == "bearer" and bool(expected)
    return is_bearer and secrets.compare_digest(given.strip().encode(), expected.encode())
