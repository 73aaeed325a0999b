"""Contestants, scenarios and scenes that nobody is to choose any more; nothing goes away."""

from __future__ import annotations

from typing import TypeVar

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.models import BaseScene, Contestant, Scenario
from augment.services.events import log_event

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
