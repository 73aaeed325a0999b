"""Zips of a job's scenarios, which workers write."""

from __future__ import annotations

import uuid

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from augment.models import GenerationJob


class ScenarioFile(models.Model):
    """All that a job made, in one format, as one zip; the newest of a job and format counts."""

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        READY = "ready", "Ready"
        FAILED = "failed", "Failed"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    job = models.ForeignKey(GenerationJob, on_delete=models.CASCADE, related_name="files")
    format = models.CharField(max_length=40, help_text="commonroad, scenarionet, ...")
    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    fault = models.CharField(max_length=500, blank=True, help_text="why it could not be written")
    name = models.CharField(max_length=200, blank=True, help_text="what it is called for people")
    stored = models.CharField(max_length=120, blank=True, help_text="its name in the storage")
    size_bytes = models.PositiveBigIntegerField(default=0)
    digest = models.CharField(max_length=64, blank=True, help_text="SHA-256 of the zip")
    warnings = models.JSONField(
        default=list, blank=True, help_text="what comes with passing it on"
    )
    is_non_commercial = models.BooleanField(default=False)
    asked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL, null=True, blank=True, on_delete=models.SET_NULL
    )
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("job", "format", "-pk")
        constraints = (
            models.CheckConstraint(
                name="scenario_file_state_is_known",
                condition=Q(state__in=["queued", "running", "ready", "failed"]),
            ),
            models.CheckConstraint(
                name="ready_scenario_file_is_stored",
                condition=~Q(state="ready") | ~Q(stored=""),
            ),
        )
        indexes = (models.Index(F("job"), F("format"), name="scenario_file_of_job"),)

    def __str__(self) -> str:
        return f"{self.job} as {self.format}"

    @property
    def is_waiting(self) -> bool:
        """Whether a worker has it, or will have it."""
        return self.state in (self.State.QUEUED, self.State.RUNNING)
