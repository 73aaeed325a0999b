"""Studies that somebody still sets up: what stands in the form, nothing that holds."""

from __future__ import annotations

import uuid
from typing import Any

from django.conf import settings
from django.db import models


class StudyDraft(models.Model):
    """The fields of a new study as they were left; opening it makes the Study.

    It names people, contestants, scenarios and jobs and holds none of them: whoever retires or
    removes one is not hindered, and the draft's page says what is gone.
    """

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    entered = models.JSONField(
        default=dict, help_text="by field: a text, yes or no, or names; see services.study_drafts"
    )
    revision = models.PositiveIntegerField(
        default=1, help_text="counts what was saved, so that nobody overwrites what they never saw"
    )
    changed_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="study_drafts",
    )
    made_at = models.DateTimeField(auto_now_add=True)
    changed_at = models.DateTimeField(auto_now=True)

    class Meta:
        ordering = ("-changed_at", "-pk")

    def __str__(self) -> str:
        return self.name or str(self.code)

    @property
    def name(self) -> str:
        """What the study is to be called; may be empty."""
        return str(self.entered.get("name", ""))

    def names_in(self, field: str) -> list[str]:
        """What is chosen in a field of names."""
        found: Any = self.entered.get(field, [])
        return list(found)
