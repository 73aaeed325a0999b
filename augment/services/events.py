"""The append-only log: every write of a service leaves a line."""

from typing import Any, TypeVar

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.models import (
    BaseScene,
    Benchmark,
    Contestant,
    EndpointModel,
    Event,
    GenerationJob,
    Scenario,
    SceneUpload,
)


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


_KINDS = {BaseScene: "scene", EndpointModel: "model", GenerationJob: "job", SceneUpload: "upload"}
"""What the log calls rows whose own name is longer."""

Retirable = TypeVar("Retirable", Contestant, Scenario, BaseScene, Benchmark)


def log_change(
    row: Any,
    verb: str,
    actor: User | None = None,
    *,
    before: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
) -> Event:
    """Append one line about a row with a public code; as `log_event`."""
    return log_event(
        actor=actor,
        verb=verb,
        object_kind=_KINDS.get(type(row)) or row._meta.verbose_name,
        object_code=row.code,
        before=before,
        after=after,
    )


@transaction.atomic
def retire(row: Retirable, *, actor: User | None = None, is_retired: bool = True) -> Retirable:
    """Let forms and `all` leave a row out, or offer it again; else it stays as it is."""
    rows = type(row)._default_manager.filter(pk=row.pk, retired_at__isnull=is_retired)
    if rows.update(retired_at=timezone.now() if is_retired else None):
        verb = "retire" if is_retired else "take back"
        log_change(row, verb, actor, after={"slug": row.slug})
    row.refresh_from_db()
    return row
