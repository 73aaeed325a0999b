"""Tokens by which programs use the API."""

from __future__ import annotations

import uuid
from datetime import datetime
from typing import ClassVar

from django.conf import settings
from django.db import models
from django.db.models import Q


class ApiToken(models.Model):
    """One token of one account. It is shown once and kept only as a hash.

    The role is never more than the owner's of the moment; see `arena.queries.api_tokens`.
    """

    class State(models.TextChoices):
        ALIVE = "alive", "Works"
        EXPIRED = "expired", "Expired"
        REVOKED = "revoked", "Revoked"

    ROLES: ClassVar = ("admin", "analyst", "expert")

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    owner = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="api_tokens"
    )
    name = models.CharField(max_length=80, help_text="what it is for")
    role = models.CharField(max_length=10, choices=[(role, role) for role in ROLES])
    token_sha256 = models.CharField(max_length=64, unique=True, editable=False)
    made_at = models.DateTimeField(auto_now_add=True)
    expires_at = models.DateTimeField()
    last_used_at = models.DateTimeField(null=True, blank=True)
    revoked_at = models.DateTimeField(null=True, blank=True)
    window_began_at = models.DateTimeField(
        null=True, blank=True, help_text="since when `window_requests` are counted"
    )
    window_requests = models.PositiveIntegerField(default=0)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.CheckConstraint(
                name="api_token_role_is_known",
                condition=Q(role__in=["admin", "analyst", "expert"]),
            ),
        )

    def __str__(self) -> str:
        return str(self.code)

    def state(self, now: datetime) -> State:
        """Whether the token works at that time, and if not, why."""
        if self.revoked_at is not None:
            return self.State.REVOKED
        return self.State.EXPIRED if self.expires_at <= now else self.State.ALIVE
