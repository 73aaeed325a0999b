"""Drives: a planner in a scene, before or after its change, and how it went."""

from __future__ import annotations

from django.db import models
from django.db.models import Q

from augment.models.jobs import Augmentation
from augment.models.scenes import Scenario
from augment.models.work import Work


class Simulation(Work):
    """One closed-loop drive: scenario x what was changed x planner and its options.

    The scene as it was and with its reference is driven once for all jobs; each augmentation has
    drives of its own.
    """

    class Subject(models.TextChoices):
        UNMODIFIED = "unmodified", "Unmodified scene"
        REFERENCE = "reference", "Reference"
        AUGMENTATION = "augmentation", "Augmentation"

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        DONE = "done", "Done"
        FAILED = "failed", "Failed"

    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="simulations")
    augmentation = models.ForeignKey(
        Augmentation, null=True, blank=True, on_delete=models.CASCADE, related_name="simulations"
    )
    subject = models.CharField(max_length=20, choices=Subject.choices)
    planner = models.CharField(max_length=120, help_text="pdm-closed, idm, or a dotted path")
    offsets = models.CharField(max_length=20, help_text="paper or original; of PDM-Closed")
    is_reactive = models.BooleanField(
        default=False, help_text="recorded vehicles answer to the ego instead of being replayed"
    )
    state = models.CharField(max_length=20, choices=State.choices, default=State.QUEUED)
    nuplan_score = models.FloatField(null=True, blank=True, help_text="0 to 1")
    interplan_score = models.FloatField(null=True, blank=True, help_text="0 to 1")
    document = models.JSONField(
        null=True, blank=True, help_text="parts of the scores, collisions, criticality"
    )
    trace = models.BinaryField(null=True, blank=True, help_text="the drive to look at: zlib, JSON")

    class Meta:
        ordering = ("scenario__slug", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_drive_of_an_augmentation",
                fields=("augmentation", "planner", "offsets", "is_reactive"),
                condition=Q(augmentation__isnull=False),
            ),
            models.UniqueConstraint(
                name="one_drive_of_a_scene",
                fields=("scenario", "subject", "planner", "offsets", "is_reactive"),
                condition=Q(augmentation=None),
            ),
            models.CheckConstraint(
                name="drive_of_an_augmentation_names_it",
                condition=(
                    Q(subject="augmentation", augmentation__isnull=False)
                    | (~Q(subject="augmentation") & Q(augmentation=None))
                ),
            ),
            models.CheckConstraint(
                name="running_drive_is_claimed",
                condition=(
                    Q(state="running", claim__isnull=False, heartbeat_at__isnull=False)
                    | (~Q(state="running") & Q(claim=None))
                ),
            ),
            models.CheckConstraint(
                name="done_drive_has_scores",
                condition=~Q(state="done")
                | Q(
                    nuplan_score__isnull=False,
                    interplan_score__isnull=False,
                    document__isnull=False,
                    trace__isnull=False,
                ),
            ),
        )
        indexes = (models.Index(fields=("state", "sent_at")),)

    def __str__(self) -> str:
        return str(self.code)
