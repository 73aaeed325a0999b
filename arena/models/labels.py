"""Fault labels: which faults experts see in single augmentations."""

from __future__ import annotations

import uuid

from django.conf import settings
from django.db import models
from django.db.models import Q

from arena.models.tokens import fresh_token
from augment.models import AppendOnly, Augmentation, GenerationJob


class LabellingRound(models.Model):
    """Experts look at the augmentations of one job, each alone, and name their faults."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    name = models.CharField(max_length=120, unique=True, help_text="experts see it")
    job = models.ForeignKey(GenerationJob, on_delete=models.PROTECT, related_name="labellings")
    experts = models.ManyToManyField(settings.AUTH_USER_MODEL, related_name="labellings")
    seed = models.BigIntegerField()
    opened_at = models.DateTimeField(auto_now_add=True)
    closed_at = models.DateTimeField(null=True, blank=True, help_text="takes no labels since")

    class Meta:
        ordering = ("-opened_at", "-pk")

    def __str__(self) -> str:
        return self.name


class LabelTask(models.Model):
    """One planned showing of one augmentation to one expert."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    labelling = models.ForeignKey(LabellingRound, on_delete=models.CASCADE, related_name="tasks")
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.PROTECT, related_name="label_tasks"
    )
    position = models.PositiveIntegerField(help_text="place in the expert's own order, from 1")
    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.PROTECT, related_name="label_tasks"
    )
    token = models.CharField(max_length=40, unique=True, default=fresh_token)
    original_token = models.CharField(max_length=40, unique=True, default=fresh_token)

    class Meta:
        ordering = ("labelling", "expert", "position")
        constraints = (
            models.UniqueConstraint(
                name="one_label_task_per_position", fields=("labelling", "expert", "position")
            ),
            models.UniqueConstraint(
                name="one_label_task_per_augmentation", fields=("augmentation", "expert")
            ),
            models.CheckConstraint(
                name="label_task_counts_from_one", condition=Q(position__gte=1)
            ),
        )

    def __str__(self) -> str:
        return str(self.code)


class FaultLabel(AppendOnly):
    """Which faults an expert sees in one augmentation: any of three, or none. Append-only.

    What the checks guessed is kept as it was when the label was saved; null where they could
    not be run.
    """

    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.PROTECT, related_name="fault_labels"
    )
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.PROTECT, related_name="fault_labels"
    )
    task = models.OneToOneField(LabelTask, on_delete=models.PROTECT, related_name="label")
    position = models.BooleanField()
    heading = models.BooleanField()
    logic = models.BooleanField()
    note = models.TextField(blank=True, max_length=2000)
    guessed_position = models.BooleanField(null=True)
    guessed_heading = models.BooleanField(null=True)
    guessed_logic = models.BooleanField(null=True)
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_fault_label_per_expert", fields=("augmentation", "expert")
            ),
            models.CheckConstraint(
                name="fault_guess_is_whole_or_absent",
                condition=Q(
                    guessed_position__isnull=True,
                    guessed_heading__isnull=True,
                    guessed_logic__isnull=True,
                )
                | Q(
                    guessed_position__isnull=False,
                    guessed_heading__isnull=False,
                    guessed_logic__isnull=False,
                ),
            ),
        )

    def __str__(self) -> str:
        return f"{self.augmentation_id} by {self.expert_id}"
