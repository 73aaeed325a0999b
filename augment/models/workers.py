"""Worker processes and their signs of life."""

from __future__ import annotations

from django.db import models


class Worker(models.Model):
    """A worker process: when it was last heard, and whether it brings lost work back.

    All times are the database's.
    """

    name = models.CharField(max_length=120)
    started_at = models.DateTimeField()
    seen_at = models.DateTimeField()
    ended_at = models.DateTimeField(null=True, blank=True, help_text="it ended in order")
    recovered_at = models.DateTimeField(
        null=True, blank=True, help_text="it last brought lost work back, or saw that none is lost"
    )
    fault = models.TextField(blank=True, help_text="why it could not since then")

    class Meta:
        ordering = ("-seen_at",)
        indexes = (models.Index(fields=("seen_at",)),)

    def __str__(self) -> str:
        return self.name
