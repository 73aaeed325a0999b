"""Whether the parts of an installation answer: what load balancers and people on duty ask."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from django.db import DatabaseError, connection
from django.db.migrations.executor import MigrationExecutor

from augment.errors import QueueFault
from augment.services.running.workers import workforce
from augment.tasks import check_broker

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
        check_broker()
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


PARTS: tuple[Callable[[], PartState], ...] = (look_at_database, look_at_broker, look_at_workers)


def look_at_parts() -> tuple[PartState, ...]:
    """All of them, in the order in which they need each other."""
    return tuple(look() for look in PARTS)
