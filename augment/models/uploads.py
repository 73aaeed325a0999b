"""Recordings that somebody sent by a page, and the moments of them that somebody looked at."""

from __future__ import annotations

from django.conf import settings
from django.db import models
from django.db.models import Q

from augment.models.scenes import BaseScene
from augment.models.work import Work


class SceneUpload(Work):
    """A file as it came; a worker finds out what it is and what it holds."""

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        READ = "read", "Read"
        FAILED = "failed", "Failed"

    name = models.CharField(max_length=120, help_text="of the file, in plain letters")
    stored = models.CharField(
        max_length=120, blank=True, help_text="name in the media storage; empty once removed"
    )
    size_bytes = models.PositiveBigIntegerField()
    digest = models.CharField(max_length=64, help_text="SHA-256 of the file")
    asked_format = models.CharField(max_length=40, blank=True, help_text="empty to recognise it")
    format = models.CharField(max_length=40, blank=True, help_text="as it was read")
    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    tracks = models.JSONField(
        default=list, blank=True, help_text="parts with moments, as services.scenarios.uploads"
    )
    is_cut = models.BooleanField(default=False, help_text="it holds more than is offered")
    uploaded_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="+",
    )

    class Meta:
        ordering = ("-pk",)
        constraints = (
            models.CheckConstraint(
                name="upload_state_is_known",
                condition=Q(state__in=["queued", "running", "read", "failed"]),
            ),
        )

    def __str__(self) -> str:
        return self.name


class UploadMoment(Work):
    """A moment of an upload: drawn for whoever chooses, and kept as a scene if they want it."""

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        DRAWN = "drawn", "Drawn"
        KEEPING = "keeping", "Being kept"
        KEPT = "kept", "Kept"
        FAILED = "failed", "Failed"

    UNDER_WAY = (State.QUEUED, State.KEEPING)
    STARTED = {}
    GIVEN_BACK = {}

    upload = models.ForeignKey(SceneUpload, on_delete=models.CASCADE, related_name="moments")
    item = models.CharField(max_length=200, blank=True)
    frame = models.PositiveIntegerField(default=0)
    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    picture = models.CharField(max_length=120, blank=True, help_text="name in the media storage")
    report = models.JSONField(null=True, blank=True, help_text="counts and notes, once read")
    slug = models.CharField(max_length=80, blank=True, help_text="the name it is to be kept under")
    scene = models.ForeignKey(
        BaseScene, null=True, blank=True, on_delete=models.SET_NULL, related_name="+"
    )
    asked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="+",
    )

    class Meta:
        ordering = ("pk",)
        constraints = (
            models.UniqueConstraint(
                name="one_row_a_moment_of_an_upload", fields=("upload", "item", "frame")
            ),
            models.CheckConstraint(
                name="upload_moment_state_is_known",
                condition=Q(state__in=["queued", "drawn", "keeping", "kept", "failed"]),
            ),
        )

    def __str__(self) -> str:
        return f"{self.upload}, {self.item} {self.frame}"
