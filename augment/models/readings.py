"""Intents that a language model read, until a person has said what becomes of them."""

from __future__ import annotations

from django.conf import settings
from django.db import models
from django.db.models import Q

from augment.models.contestants import Endpoint
from augment.models.scenes import Scenario
from augment.models.work import Work


class IntentReading(Work):
    """One reading of a scenario's instruction. It counts for nothing until it is accepted.

    Its calls are rows as those of a job are; the caps are of this reading alone.
    """

    class State(models.TextChoices):
        RUNNING = "running", "Running"
        READ = "read", "Read, not accepted yet"
        ACCEPTED = "accepted", "Accepted"
        FAILED = "failed", "Failed"

    UNDER_WAY = (State.RUNNING,)
    GIVEN_BACK = {"state": State.RUNNING}

    scenario = models.ForeignKey(Scenario, on_delete=models.CASCADE, related_name="readings")
    endpoint = models.ForeignKey(Endpoint, on_delete=models.PROTECT, related_name="readings")
    model = models.CharField(max_length=120)
    state = models.CharField(max_length=10, choices=State.choices, default=State.RUNNING)
    document = models.JSONField(
        null=True, blank=True, help_text="what was read, in augment.scene.codec's format"
    )
    cap_nano_usd = models.PositiveBigIntegerField(null=True, blank=True)
    cap_calls = models.PositiveIntegerField(null=True, blank=True)
    cap_tokens = models.PositiveBigIntegerField(null=True, blank=True)
    asked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL, null=True, blank=True, on_delete=models.PROTECT, related_name="+"
    )

    class Meta:
        ordering = ("-pk",)
        constraints = (
            models.CheckConstraint(
                name="reading_has_a_document_once_read",
                condition=Q(state__in=("running", "failed"), document__isnull=True)
                | Q(state__in=("read", "accepted"), document__isnull=False),
            ),
        )

    def __str__(self) -> str:
        return f"reading of {self.scenario_id} by {self.model}"
