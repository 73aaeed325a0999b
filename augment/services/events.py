"""The append-only log: every write of a service leaves a line."""

from __future__ import annotations

from typing import Any, TypeVar

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.models import BaseScene, Contestant, Event, Scenario


@transaction.atomic
def log_event(
    *,
    actor: User | None,
    verb: str,
    object_kind: str,
    object_code: object,
    before: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
) -> Event:
    """Append one line.

    Args:
        actor: Who did it; None for the machine itself.
        verb: What was done: "import", "launch", "vote".
        object_kind: What it was done to: "scene", "scenario", "study".
        object_code: The object's public code, or another lasting name of it.
        before: What changed, as it was; None where there was nothing.
        after: What changed, as it is now.
    """
    return Event.objects.create(
        actor=actor,
        verb=verb,
        object_kind=object_kind,
        object_code=str(object_code),
        before=before,
        after=after,
    )


Retirable = TypeVar("Retirable", Contestant, Scenario, BaseScene)
_KINDS = {Contestant: "contestant", Scenario: "scenario", BaseScene: "scene"}


@transaction.atomic
def retire(row: Retirable, *, actor: User | None = None) -> Retirable:
    """Let forms and `all` leave it out; a retired one stays as it is."""
    return _set(row, is_retired=True, actor=actor)


@transaction.atomic
def take_back(row: Retirable, *, actor: User | None = None) -> Retirable:
    """Let it be chosen again."""
    return _set(row, is_retired=False, actor=actor)


def _set(row: Retirable, *, is_retired: bool, actor: User | None) -> Retirable:
    rows = type(row)._default_manager.filter(pk=row.pk, retired_at__isnull=is_retired)
    if rows.update(retired_at=timezone.now() if is_retired else None):
        log_event(
            actor=actor,
            verb="retire" if is_retired else "take back",
            object_kind=_KINDS[type(row)],
            object_code=row.code,
            after={"slug": row.slug},
        )
    row.refresh_from_db()
    return row
