"""The append-only log."""

from __future__ import annotations

from django.conf import settings
from django.db import models

from augment.models.work import AppendOnly


class Event(AppendOnly):
    """One line of the append-only log: who did what to which object, when, before and after."""

    actor = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="events",
        help_text="null for the machine itself",
    )
    verb = models.CharField(max_length=60)
    object_kind = models.CharField(max_length=40)
    object_code = models.CharField(max_length=64)
    before = models.JSONField(null=True, blank=True)
    after = models.JSONField(null=True, blank=True)
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-at", "-pk")
        indexes = (models.Index(fields=("object_kind", "object_code")),)

    def __str__(self) -> str:
        return f"{self.verb} {self.object_kind} {self.object_code}"
