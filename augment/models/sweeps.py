"""Sweeps: one number of a scenario over several values, each driven."""

from django.db import models
from django.db.models import Q

from augment.models.scenes import Scenario
from augment.models.work import CodedModel, account_column


class Sweep(CodedModel):
    """A number of a scenario's intent or reference, and the planner that is under test."""

    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="sweeps")
    number = models.CharField(max_length=200, help_text="its path in the intent or reference")
    planner = models.CharField(max_length=120, help_text="under test: pdm-closed, idm, a path")
    offsets = models.CharField(max_length=20, help_text="paper or original; of PDM-Closed")
    is_reactive = models.BooleanField(default=False)
    asked_by = account_column(on_delete=models.SET_NULL)
    created_at = models.DateTimeField(auto_now_add=True)
    concluded_at = models.DateTimeField(
        null=True, blank=True, help_text="when the last drive had an outcome"
    )
    hardest = models.ForeignKey(
        Scenario,
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="+",
        help_text="the hardest value that is solved, kept; null where there is none",
    )

    class Meta:
        ordering = ("-pk",)

    def __str__(self) -> str:
        return f"{self.scenario.slug}: {self.number}"


class SweepValue(models.Model):
    """One value, and what the scenario's change is with it; its drives are simulations."""

    sweep = models.ForeignKey(Sweep, on_delete=models.CASCADE, related_name="values")
    value = models.FloatField()
    modification = models.JSONField(
        null=True, blank=True, help_text="in augment.scene.codec's format; null where none fits"
    )
    reason = models.TextField(blank=True, help_text="why none fits")

    class Meta:
        ordering = ("sweep", "value")
        constraints = (
            models.UniqueConstraint(name="one_row_a_value_of_a_sweep", fields=("sweep", "value")),
            models.CheckConstraint(
                name="swept_modification_or_reason",
                condition=Q(modification__isnull=False, reason="")
                | (Q(modification=None) & ~Q(reason="")),
            ),
        )
