"""Links that let an expert in without a password."""

from __future__ import annotations

import hashlib
import uuid
from datetime import datetime
from typing import ClassVar

from django.conf import settings
from django.db import models
from django.db.models import Q

from arena.models.studies import Study


class Invitation(models.Model):
    """One link for one expert of one study. Its token is sent once and kept only as a hash.

    A new link replaces the one before, so at most one link of an expert and study is alive, and
    each can be taken back by itself.
    """

    class State(models.TextChoices):
        UNUSED = "unused", "Not opened yet"
        USED = "used", "Used"
        EXPIRED = "expired", "Expired"
        REVOKED = "revoked", "Taken back"

    ALIVE: ClassVar = frozenset({State.UNUSED, State.USED})

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="invitations")
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="invitations"
    )
    token_sha256 = models.CharField(max_length=64, unique=True, editable=False)
    invited_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="+",
        help_text="none for a link that was made by the command",
    )
    made_at = models.DateTimeField(auto_now_add=True)
    expires_at = models.DateTimeField()
    used_at = models.DateTimeField(null=True, blank=True, help_text="when it first let in")
    revoked_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.UniqueConstraint(
                name="one_live_link_per_expert",
                fields=("study", "expert"),
                condition=Q(revoked_at=None),
            ),
        )

    def __str__(self) -> str:
        return str(self.code)

    def state(self, now: datetime) -> State:
        """Whether the link works at that time, and if not, why."""
        if self.revoked_at is not None:
            return self.State.REVOKED
        if self.expires_at <= now:
            return self.State.EXPIRED
        return self.State.UNUSED if self.used_at is None else self.State.USED


def token_digest(token: str) -> str:
    """What is stored of a token: 32 random bytes need no salt and no slow hash."""
    return hashlib.sha256(token.encode()).hexdigest()
