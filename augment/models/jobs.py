"""Jobs, their rows, and the tries at each row."""

from __future__ import annotations

import uuid
from decimal import Decimal

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from augment.llm.costs import usd_of
from augment.models.contestants import Contestant
from augment.models.scenes import Scenario
from augment.models.work import Work


class GenerationJob(models.Model):
    """Contestants x scenarios x samples, launched by an admin, within caps on what it may use.

    Money is counted in whole nano-dollars, so that sums are exact on every database. Each call
    moves its worst case into `reserved_*` before it is sent, and what it used into `spent_*`
    afterwards; a cap is compared with the sum of both. Null is no cap.
    """

    class State(models.TextChoices):
        RUNNING = "running", "Running"
        CANCELLED = "cancelled", "Cancelled"
        FINISHED = "finished", "Finished"
        STOPPED_AT_CAP = "stopped_at_cap", "Stopped at cap"
        PAUSED = "paused", "Paused"

    HELD = (State.STOPPED_AT_CAP, State.PAUSED)
    """States in which nothing is started until somebody resumes the job."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    name = models.CharField(max_length=120)
    state = models.CharField(max_length=20, choices=State.choices, default=State.RUNNING)
    contestants = models.ManyToManyField(Contestant, related_name="jobs")
    scenarios = models.ManyToManyField(Scenario, related_name="jobs")
    launched_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="generation_jobs",
    )
    samples = models.PositiveSmallIntegerField(
        default=1, help_text="so often every contestant is asked about every scenario"
    )
    is_fresh = models.BooleanField(
        default=False, help_text="ask anew what was answered in other jobs before"
    )
    full_plan = models.JSONField(
        null=True,
        blank=True,
        help_text="of a job that tries one scenario first: what was chosen for the whole one",
    )
    cap_nano_usd = models.PositiveBigIntegerField(null=True, blank=True)
    cap_calls = models.PositiveIntegerField(null=True, blank=True)
    cap_tokens = models.PositiveBigIntegerField(null=True, blank=True)
    reserved_nano_usd = models.PositiveBigIntegerField(default=0)
    reserved_calls = models.PositiveIntegerField(default=0)
    reserved_tokens = models.PositiveBigIntegerField(default=0)
    spent_nano_usd = models.PositiveBigIntegerField(default=0)
    spent_calls = models.PositiveIntegerField(default=0)
    spent_tokens = models.PositiveBigIntegerField(default=0)
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("-created_at", "-pk")

    def __str__(self) -> str:
        return self.name

    @property
    def is_capped(self) -> bool:
        """Whether there is any cap."""
        caps = (self.cap_nano_usd, self.cap_calls, self.cap_tokens)
        return any(cap is not None for cap in caps)

    @property
    def cap_usd(self) -> Decimal | None:
        """The money cap, None without one."""
        return None if self.cap_nano_usd is None else usd_of(self.cap_nano_usd)

    @property
    def reserved_usd(self) -> Decimal:
        """The worst case of the calls in flight, as far as their prices are known."""
        return usd_of(self.reserved_nano_usd)

    @property
    def spent_usd(self) -> Decimal:
        """What was used, as far as prices are known."""
        return usd_of(self.spent_nano_usd)


class Augmentation(Work):
    """One row of a job: scenario x contestant x sample -> modification, image, or why not.

    `queued` and `running` are under way; all other states are outcomes. `unreadable` and `refused`
    are the contestant's own and count as a miss: their picture is the unchanged scene. `failed`
    is a fault of the machinery (an endpoint that answers 500) and may be tried again.
    """

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        DONE = "done", "Done"
        UNREADABLE = "unreadable", "Unreadable answer"
        REFUSED = "refused", "Refused"
        FAILED = "failed", "Failed"
        CANCELLED = "cancelled", "Cancelled"

    SHOWABLE = (State.DONE, State.UNREADABLE, State.REFUSED)
    """States with a picture that an expert can judge."""

    job = models.ForeignKey(GenerationJob, on_delete=models.CASCADE, related_name="augmentations")
    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="augmentations")
    contestant = models.ForeignKey(
        Contestant, on_delete=models.PROTECT, related_name="augmentations"
    )
    sample = models.PositiveSmallIntegerField(default=1, help_text="1 for the first")
    options = models.JSONField(
        null=True,
        blank=True,
        help_text="with which its contestant asked; null where no model was asked",
    )
    state = models.CharField(max_length=20, choices=State.choices, default=State.QUEUED)
    modification = models.JSONField(null=True, blank=True)
    notes = models.TextField(blank=True, help_text="what the contestant said about its own work")
    injected = models.JSONField(
        null=True,
        blank=True,
        help_text='what a simulated contestant did wrong: {"class": ..., "fault": ...}; its true '
        "label, for analysts alone",
    )
    corrects = models.ForeignKey(
        "self",
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="corrections",
        help_text="what a person corrected by it",
    )
    made_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="+",
        help_text="whose hand made the modification; null where no person did",
    )
    image = models.CharField(max_length=120, blank=True, help_text="name in the media storage")
    earlier_images = models.JSONField(
        default=list, blank=True, help_text="names of its pictures in windows of before"
    )
    asked_anew_at = models.DateTimeField(
        null=True, blank=True, help_text="answers from before are not used again for it"
    )

    class Meta:
        ordering = ("scenario__slug", "contestant__slug", "sample")
        constraints = (
            models.UniqueConstraint(
                name="one_augmentation_per_cell",
                fields=("job", "scenario", "contestant", "sample"),
            ),
            models.CheckConstraint(name="sample_counts_from_one", condition=Q(sample__gte=1)),
            models.CheckConstraint(
                name="running_augmentation_is_claimed",
                condition=(
                    Q(state="running") & Q(claim__isnull=False) & Q(heartbeat_at__isnull=False)
                )
                | (~Q(state="running") & Q(claim=None)),
            ),
            models.CheckConstraint(
                name="done_augmentation_has_modification_and_image",
                condition=~Q(state="done") | (Q(modification__isnull=False) & ~Q(image="")),
            ),
        )
        indexes = (
            models.Index(fields=("job", "state")),
            models.Index(fields=("state", "sent_at")),
        )

    def __str__(self) -> str:
        return str(self.code)


class Attempt(models.Model):
    """One try at an augmentation, from claim to outcome; a killed worker leaves it unfinished."""

    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.CASCADE, related_name="attempts"
    )
    number = models.PositiveIntegerField()
    worker = models.CharField(max_length=120, blank=True)
    started_at = models.DateTimeField()
    finished_at = models.DateTimeField(null=True, blank=True)
    outcome = models.CharField(max_length=20, blank=True)
    reason = models.TextField(blank=True)

    class Meta:
        ordering = ("number",)
        constraints = (
            models.UniqueConstraint(
                name="attempt_number_is_unique", fields=("augmentation", "number")
            ),
            models.CheckConstraint(name="attempt_counts_from_one", condition=Q(number__gte=1)),
            models.CheckConstraint(
                name="attempt_ends_after_start",
                condition=Q(finished_at=None) | Q(finished_at__gte=F("started_at")),
            ),
        )

    def __str__(self) -> str:
        return f"attempt {self.number}"
