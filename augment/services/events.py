"""The append-only log: every write of a service leaves a line."""

from typing import Any, TypeVar

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.models import BaseScene, Benchmark, Contestant, Event, Scenario

_KINDS = {
    **{"base scene": "scene", "endpoint model": "model", "generation job": "job"},
    **{"labelling round": "labelling", "scene upload": "upload"},
}
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
    """Append one line about a row with a public code.

    Args:
        row: What something was done to.
        verb: What was done: "import", "launch", "vote".
        actor: Who did it; None for the machine itself.
        before: What changed, as it was; None where there was nothing.
        after: What changed, as it is now.
    """
    name = row._meta.verbose_name
    return Event.objects.create(
        actor=actor,
        verb=verb,
        object_kind=_KINDS.get(name, name),
        object_code=str(row.code),
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
