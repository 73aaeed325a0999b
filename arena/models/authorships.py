"""Who made what: an expert of a study who is the author of one of its contestants."""

from __future__ import annotations

import uuid

from django.conf import settings
from django.db import models

from arena.models.studies import Study
from augment.models import Contestant


class Authorship(models.Model):
    """An expert has a stake in a contestant of the study; no expert ever learns of it.

    What is taken back is deleted here and stays in the log.
    """

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="authorships")
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="authorships"
    )
    contestant = models.ForeignKey(
        Contestant, on_delete=models.CASCADE, related_name="authorships"
    )
    marked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="+",
        help_text="none where the command did",
    )
    marked_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("marked_at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_authorship_each", fields=("study", "expert", "contestant")
            ),
        )

    def __str__(self) -> str:
        return str(self.code)
