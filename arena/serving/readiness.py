"""Health checks of the database, the broker and the workers, for load balancers and operators."""

import secrets
from dataclasses import dataclass

from django.conf import settings
from django.core.cache import cache
from django.db import DatabaseError, connection
from django.db.migrations.executor import MigrationExecutor
from django.db.migrations.loader import MigrationLoader

from augment.errors import QueueFault
from augment.services.running import workforce
from augment.tasks import check_broker

BROKER_WITHIN_S = 1.0
HELD_FOR_S = 5.0
"""Probes need no account, so a request must stay cheap."""


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
        # Migrations don't go away under a running process.
        is_known = cache.get("is_prepared")
        missing = [] if is_known else find_unapplied_migrations()
        later = [] if is_known or missing else find_later_migrations()
        with connection.cursor() as cursor:
            cursor.execute("SELECT 1")
    except DatabaseError as error:
        return PartState("database", False, "unreachable", str(error))
    if missing:
        return PartState("database", False, "unprepared", f"not applied: {', '.join(missing)}")
    if later:
        return PartState("database", False, "later", f"of a later release: {', '.join(later)}")
    cache.set("is_prepared", True, timeout=None)
    return PartState("database", True, "ok")


def find_unapplied_migrations() -> list[str]:
    """The migrations of this release that the database lacks, as app.name."""
    executor = MigrationExecutor(connection)
    plan = executor.migration_plan(executor.loader.graph.leaf_nodes())
    return [f"{migration.app_label}.{migration.name}" for migration, _ in plan]


def find_later_migrations() -> list[str]:
    """The migrations of ours that a later release has applied; a squashed one stands for many."""
    loader = MigrationLoader(connection)
    ours = loader.disk_migrations
    strange = loader.applied_migrations.keys() - ours.keys()
    strange -= {old for migration in ours.values() for old in migration.replaces}
    return sorted(f"{app}.{name}" for app, name in strange if app in ("arena", "augment"))


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
        workers = workforce()
    except DatabaseError as error:
        return PartState("workers", False, "unknown", str(error))
    if not workers.living:
        since = (
            f"since {workers.silent_since:%Y-%m-%d %H:%M:%S} UTC" if workers.silent_since else ""
        )
        return PartState("workers", False, "none", f"no worker is running {since}".strip())
    if not workers.works:
        return PartState(
            "workers", False, "stuck", f"lost work is not brought back: {workers.fault}"
        )
    return PartState("workers", True, "ok", f"{workers.living} running")


def look_at_parts() -> tuple[PartState, ...]:
    """Return the state of every part; broker and workers as they were at most HELD_FOR_S ago."""
    others: tuple[PartState, ...] | None = cache.get("parts")
    if others is None:
        others = (look_at_broker(), look_at_workers())
        cache.set("parts", others, timeout=HELD_FOR_S)
    return (look_at_database(), *others)


def opens_metrics(authorization: str | None) -> bool:
    """Return whether a header bears the configured metrics token; False without a token."""
    expected = settings.METRICS_TOKEN
    scheme, _, credentials = (authorization or "").partition(" ")
    is_bearer = scheme.lower() == "bearer" and bool(expected)
    return is_bearer and secrets.compare_digest(credentials.strip().encode(), expected.encode())
