"""Systems that came as files: what was sent, what reading it found, what was decided."""

from django.db import models
from django.db.models import Q

from augment.models.benchmarks import Benchmark
from augment.models.contestants import Contestant
from augment.models.work import SentFile, account_column


class Submission(SentFile):
    """A folder of answers to a benchmark's tasks; accepted, it is a contestant's only source."""

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Being read"
        CHECKED = "checked", "Checked"
        FAILED = "failed", "Can’t be read"

    class Decision(models.TextChoices):
        NONE = "none", "Not decided"
        ACCEPTED = "accepted", "Accepted"
        DECLINED = "declined", "Declined"
        WITHDRAWN = "withdrawn", "Withdrawn"

    benchmark = models.ForeignKey(Benchmark, on_delete=models.PROTECT, related_name="submissions")
    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    report = models.JSONField(
        null=True, blank=True, help_text="all that was found in it, as augment.benchmark says"
    )
    summary = models.JSONField(
        null=True, blank=True, help_text="its card, and the report in numbers"
    )
    decision = models.CharField(max_length=10, choices=Decision.choices, default=Decision.NONE)
    decision_reason = models.TextField(blank=True, help_text="why it was declined")
    decided_by = account_column(on_delete=models.SET_NULL)
    decided_at = models.DateTimeField(null=True, blank=True)
    contestant = models.OneToOneField(
        Contestant,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="submission",
        help_text="who answers from it, once it is accepted",
    )

    class Meta:
        ordering = ("-pk",)
        constraints = (
            models.CheckConstraint(
                name="submission_state_is_known",
                condition=Q(state__in=["queued", "running", "checked", "failed"]),
            ),
            models.CheckConstraint(
                name="accepted_submission_has_report_and_contestant",
                condition=Q(decision__in=["none", "declined", "withdrawn"], contestant=None)
                | Q(decision="accepted", contestant__isnull=False, report__isnull=False),
            ),
        )

    def __str__(self) -> str:
        return self.name

    @property
    def title(self) -> str:
        """The name on its card, of a file that has not been read its own."""
        return str(self.summary["card"]["name"]) if self.summary else self.name

    @property
    def is_decided(self) -> bool:
        """True if nothing is left to do with it."""
        return self.decision != self.Decision.NONE
