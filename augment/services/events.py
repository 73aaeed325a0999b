"""The append-only log: every write of a service leaves a line."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.models import Event


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
