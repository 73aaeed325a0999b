"""Probes of models that workers make, with what they have seen so far."""

from __future__ import annotations

from django.conf import settings
from django.db import models

from augment.models.contestants import EndpointModel
from augment.models.work import Work


class Probe(Work):
    """One round of questions to a model; its last report is also kept with the model."""

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        DONE = "done", "Done"
        FAILED = "failed", "Failed"

    model = models.ForeignKey(EndpointModel, on_delete=models.CASCADE, related_name="probes")
    state = models.CharField(max_length=20, choices=State.choices, default=State.QUEUED)
    findings = models.JSONField(default=list, help_text="one a question, as far as they are asked")
    asked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL, null=True, blank=True, on_delete=models.PROTECT, related_name="+"
    )

    class Meta:
        ordering = ("-created_at", "-pk")
        constraints = (
            models.UniqueConstraint(
                name="one_probe_under_way_at_a_model",
                fields=("model",),
                condition=models.Q(state__in=("queued", "running")),
            ),
        )

    def __str__(self) -> str:
        return f"probe of {self.model}"
