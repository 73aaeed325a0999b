"""Files that workers write and pages offer: asked for, being written, ready, failed."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from django.conf import settings
from django.db import models
from django.db.models import Q

from augment.models import Work


class WrittenFile(Work):
    """One file; of those of the same owner and kind the newest counts.

    Attributes:
        FOLDER: Where the content lies, among the pictures; a backup leaves it out, as it can be
            made again.
        OWN: The columns that say what the file is of; a newer row with the same replaces it.
    """

    FOLDER: ClassVar[str]
    OWN: ClassVar[tuple[str, ...]]

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        READY = "ready", "Ready"
        FAILED = "failed", "Failed"

    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    name = models.CharField(max_length=200, blank=True, help_text="what it is called for people")
    stored = models.CharField(max_length=120, blank=True, help_text="its name in the storage")
    size_bytes = models.PositiveBigIntegerField(default=0)
    digest = models.CharField(max_length=64, blank=True, help_text="SHA-256 of the content")
    warnings = models.JSONField(
        default=list, blank=True, help_text="what comes with passing it on"
    )
    is_non_commercial = models.BooleanField(default=False)
    asked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL, null=True, blank=True, on_delete=models.SET_NULL
    )

    class Meta:
        abstract = True

    @property
    def is_waiting(self) -> bool:
        """Whether a worker has it, or will have it."""
        return self.state in self.UNDER_WAY

    def alike(self) -> models.QuerySet[Self]:
        """The rows of the same owner and kind, this one among them."""
        same: dict[str, Any] = {name: getattr(self, name) for name in self.OWN}
        return type(self)._default_manager.filter(**same)


def state_is_known(name: str) -> models.CheckConstraint:
    """No other state than those above."""
    known = ["queued", "running", "ready", "failed"]
    return models.CheckConstraint(name=name, condition=Q(state__in=known))


def ready_is_stored(name: str) -> models.CheckConstraint:
    """What is ready can be read."""
    return models.CheckConstraint(name=name, condition=~Q(state="ready") | ~Q(stored=""))
