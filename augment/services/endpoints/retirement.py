"""Contestants that nobody is to choose any more; nothing of theirs goes away."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.models import Contestant
from augment.services.events import log_event


@transaction.atomic
def retire(contestant: Contestant, *, actor: User | None = None) -> Contestant:
    """Let forms and `all` leave it out; a retired one stays as it is."""
    return _set(contestant, is_retired=True, actor=actor)


@transaction.atomic
def take_back(contestant: Contestant, *, actor: User | None = None) -> Contestant:
    """Let it be chosen again."""
    return _set(contestant, is_retired=False, actor=actor)


def _set(contestant: Contestant, *, is_retired: bool, actor: User | None) -> Contestant:
    rows = Contestant.objects.filter(pk=contestant.pk, retired_at__isnull=is_retired)
    if rows.update(retired_at=timezone.now() if is_retired else None):
        log_event(
            actor=actor,
            verb="retire" if is_retired else "take back",
            object_kind="contestant",
            object_code=contestant.code,
            after={"slug": contestant.slug},
        )
    contestant.refresh_from_db()
    return contestant
