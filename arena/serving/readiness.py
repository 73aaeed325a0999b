"""Whether the parts of an installation answer: what load balancers and people on duty ask."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from django.conf import settings
from django.db import DatabaseError, connection
from django.db.migrations.executor import MigrationExecutor

from augment.broker import check_broker
from augment.errors import QueueFault
from augment.services.running.workers import workforce

BROKER_WITHIN_S = 1.0
HELD_FOR_S = 5.0
"""A probe is asked by everybody and signs in nobody: it must not be dear."""

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
    """Whether it answers and has the tables of this release."""
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
    """Whether messages to workers can be sent."""
    try:
        check_broker(within_s=BROKER_WITHIN_S)
    except QueueFault as error:
        return PartState("broker", False, "unreachable", str(error))
    return PartState("broker", True, "ok")


def look_at_workers() -> PartState:
    """Whether somebody works, and what is lost is brought back."""
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
    """An answer that is held for a while, so that many who ask cost no more than one.

    Args:
        look: Who is asked.
        for_s: For how long an answer is held.
        clock: Seconds that only ever grow.
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
        """The answer, at most so old; who asks meanwhile waits for the one look."""
        with self._lock:
            if self._held is None or self._clock() - self._held[0] >= self._for_s:
                state = self._look()
                self._held = self._clock(), state
            return self._held[1]

    def forget(self) -> None:
        """Look anew when asked the next time."""
        with self._lock:
            self._held = None


HELD = (HeldLook(look_at_broker, for_s=HELD_FOR_S), HeldLook(look_at_workers, for_s=HELD_FOR_S))
PARTS: tuple[Callable[[], PartState], ...] = (look_at_database, *HELD)


def look_at_parts() -> tuple[PartState, ...]:
    """All of them, in the order in which they need each other."""
    return tuple(look() for look in PARTS)


def opens_metrics(authorization: str | None) -> bool:
    """Whether a header bears the token of the settings; without a token none does."""
    expected = settings.METRICS_TOKEN
    scheme, _, given = (authorization or "").partition(" ")
    is_bearer = scheme.lower() == "bearer" and bool(expected)
    return is_bearer and secrets.compare_digest(given.strip().encode(), expected.encode())
