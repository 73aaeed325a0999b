"""Benchmark sets, handed out as folders version by version, and systems that came as files."""

import uuid

from django.db import models
from django.db.models import Q

from augment.models.contestants import Contestant
from augment.models.scenes import RETIRED_HELP, SLUG_HELP, Scenario
from augment.models.work import SentFile, account_column


class Benchmark(models.Model):
    """One version of a benchmark set; its name and version together never change."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    slug = models.SlugField(max_length=80, help_text=SLUG_HELP)
    title = models.CharField(max_length=120)
    version = models.PositiveIntegerField(help_text="from 1")
    checksum = models.CharField(max_length=64, help_text="SHA-256 of what entrants get")
    made_on = models.DateField()
    made_by = account_column(on_delete=models.SET_NULL)
    retired_at = models.DateTimeField(null=True, blank=True, help_text=RETIRED_HELP)
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug", "-version")
        constraints = (
            models.UniqueConstraint(
                name="one_benchmark_a_name_and_version", fields=("slug", "version")
            ),
            models.CheckConstraint(
                name="benchmark_versions_count_from_one", condition=Q(version__gte=1)
            ),
        )

    def __str__(self) -> str:
        return f"{self.slug}@{self.version}"


class BenchmarkItem(models.Model):
    """A scenario of a benchmark set."""

    benchmark = models.ForeignKey(Benchmark, on_delete=models.CASCADE, related_name="items")
    scenario = models.ForeignKey(
        Scenario, on_delete=models.PROTECT, related_name="benchmark_items"
    )
    position = models.PositiveIntegerField(help_text="from 1")
    split = models.CharField(max_length=10, help_text="practice or test")
    stratum = models.CharField(max_length=10, help_text="easy, medium or hard")

    class Meta:
        ordering = ("benchmark", "position")
        constraints = (
            models.UniqueConstraint(
                name="a_benchmark_holds_a_scenario_once", fields=("benchmark", "scenario")
            ),
            models.UniqueConstraint(
                name="one_position_an_item_of_a_benchmark", fields=("benchmark", "position")
            ),
            models.CheckConstraint(
                name="benchmark_item_is_of_a_known_split_and_stratum",
                condition=Q(
                    split__in=["practice", "test"], stratum__in=["easy", "medium", "hard"]
                ),
            ),
        )

    def __str__(self) -> str:
        return f"{self.benchmark}: {self.scenario}"


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
