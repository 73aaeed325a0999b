"""Who has an account."""

from __future__ import annotations

import uuid

from django.conf import settings
from django.db import models


class Person(models.Model):
    """What an account is beside its login: a public code, a pseudonym and preferences."""

    user = models.OneToOneField(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="person"
    )
    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    pseudonym = models.CharField(max_length=60, unique=True)
    preferences = models.JSONField(default=dict, blank=True)
    is_simulated = models.BooleanField(
        default=False, help_text="votes of this account are made by the machine"
    )

    class Meta:
        ordering = ("pseudonym",)
        verbose_name_plural = "people"

    def __str__(self) -> str:
        return self.pseudonym
