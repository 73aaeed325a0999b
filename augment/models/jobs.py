"""Jobs, their rows, and the tries at each row."""

from decimal import Decimal

from django.db import models
from django.db.models import F, Q

from augment.llm.costs import to_usd
from augment.models.budgets import CappedWork
from augment.models.contestants import Contestant, Endpoint
from augment.models.scenes import Scenario
from augment.models.sweeps import SweepValue
from augment.models.work import CodedModel, DoneState, Work, account_column


class GenerationJob(CappedWork):
    """Contestants x scenarios x samples, launched by an admin, within caps on what it may use."""

    class State(models.TextChoices):
        RUNNING = "running", "Running"
        CANCELLED = "cancelled", "Cancelled"
        FINISHED = "finished", "Finished"
        STOPPED_AT_CAP = "stopped_at_cap", "Stopped at cap"
        PAUSED = "paused", "Paused"

    HELD = (State.STOPPED_AT_CAP, State.PAUSED)
    """States in which nothing is started until somebody resumes the job."""

    name = models.CharField(max_length=120)
    state = models.CharField(max_length=20, choices=State.choices, default=State.RUNNING)
    contestants = models.ManyToManyField(Contestant, related_name="jobs")
    scenarios = models.ManyToManyField(Scenario, related_name="jobs")
    launched_by = account_column(related_name="generation_jobs")
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

    class Meta:
        ordering = ("-created_at", "-pk")

    def __str__(self) -> str:
        return self.name


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
    MISSES = (State.UNREADABLE, State.REFUSED)
    """States of an answer without a change; they count as a miss."""

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
        "label, for researchers alone",
    )
    corrects = models.ForeignKey(
        "self",
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="corrections",
        help_text="what a person corrected by it",
    )
    follows = models.ForeignKey(
        "self",
        null=True,
        blank=True,
        on_delete=models.SET_NULL,
        related_name="follow_ups",
        help_text="its contestant's own answer to the scenario that its scenario follows",
    )
    made_by = account_column(
        help_text="whose hand made the modification; null where no person did"
    )
    image = models.CharField(max_length=120, blank=True, help_text="name in the media storage")
    earlier_images = models.JSONField(
        default=list, blank=True, help_text="names of its pictures in windows of before"
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

    @property
    def is_answer(self) -> bool:
        """True if a change came out: its own, or the one before a follow-up that was refused."""
        return bool(self.modification) and self.state in (self.State.DONE, self.State.REFUSED)


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


class IntentReading(Work):
    """One reading of a scenario's instruction. It counts for nothing until it is accepted.

    Its calls are rows as those of a job are; the caps are of this reading alone.
    """

    class State(models.TextChoices):
        RUNNING = "running", "Running"
        READ = "read", "Read, not accepted yet"
        ACCEPTED = "accepted", "Accepted"
        FAILED = "failed", "Failed"

    UNDER_WAY = (State.RUNNING,)
    GIVEN_BACK = {"state": State.RUNNING}

    scenario = models.ForeignKey(Scenario, on_delete=models.CASCADE, related_name="readings")
    endpoint = models.ForeignKey(Endpoint, on_delete=models.PROTECT, related_name="readings")
    model = models.CharField(max_length=120)
    state = models.CharField(max_length=10, choices=State.choices, default=State.RUNNING)
    document = models.JSONField(
        null=True, blank=True, help_text="what was read, in augment.scene.codec's format"
    )
    cap_nano_usd = models.PositiveBigIntegerField(null=True, blank=True)
    cap_calls = models.PositiveIntegerField(null=True, blank=True)
    cap_tokens = models.PositiveBigIntegerField(null=True, blank=True)
    asked_by = account_column()

    class Meta:
        ordering = ("-pk",)
        constraints = (
            models.CheckConstraint(
                name="reading_has_a_document_once_read",
                condition=Q(state__in=("running", "failed"), document__isnull=True)
                | Q(state__in=("read", "accepted"), document__isnull=False),
            ),
        )


class ModelCall(CodedModel):
    """One request to a language model and its raw answer, stored before anybody reads it.

    Unknown is null, never zero. A call with `served_from` was answered from the store: it costs
    nothing and counts for nothing. Until `settled_at` the call is in flight, and the reservation
    is part of its job's. Before `sent_at` nothing of it has left this computer.
    """

    attempt = models.ForeignKey(
        Attempt, null=True, blank=True, on_delete=models.CASCADE, related_name="calls"
    )
    reading = models.ForeignKey(
        IntentReading,
        null=True,
        blank=True,
        on_delete=models.CASCADE,
        related_name="calls",
        help_text="for which it was made where it was for no attempt",
    )
    judgement = models.ForeignKey(
        "augment.PairJudgement",
        null=True,
        blank=True,
        on_delete=models.CASCADE,
        related_name="calls",
        help_text="for which it was made where it was for neither",
    )
    number = models.PositiveIntegerField()
    role = models.CharField(
        max_length=20, help_text="modifier, reviewer, engineer, viewer, reader, judge"
    )
    request = models.JSONField(
        help_text="model, messages and parameters, without the key; images by their hash"
    )
    request_hash = models.CharField(max_length=64, blank=True, db_index=True)
    served_from = models.ForeignKey(
        "self", null=True, blank=True, on_delete=models.PROTECT, related_name="copies"
    )
    answer = models.TextField(null=True, blank=True, help_text="the raw text, null without one")
    refusal = models.TextField(null=True, blank=True, help_text="null where it did not decline")
    extras = models.JSONField(null=True, blank=True, help_text="what else the reply carried")
    fault = models.TextField(blank=True, help_text="what broke, if there was no answer")
    model_returned = models.CharField(max_length=120, blank=True)
    finish_reason = models.CharField(max_length=40, blank=True)
    prompt_version = models.CharField(max_length=64, blank=True)
    prompt_tokens = models.PositiveIntegerField(null=True, blank=True)
    completion_tokens = models.PositiveIntegerField(null=True, blank=True)
    started_at = models.DateTimeField(help_text="room was reserved, the wait for a place began")
    sent_at = models.DateTimeField(
        null=True, blank=True, help_text="null while it waits, and for ever where it was not sent"
    )
    latency_s = models.FloatField(null=True, blank=True)
    reserved_tokens = models.PositiveBigIntegerField(default=0)
    reserved_nano_usd = models.PositiveBigIntegerField(null=True, blank=True)
    spent_tokens = models.PositiveBigIntegerField(null=True, blank=True)
    cost_nano_usd = models.PositiveBigIntegerField(
        null=True, blank=True, help_text="null while in flight or where the price is unknown"
    )
    is_cost_estimated = models.BooleanField(
        default=False, help_text="usage is unknown: the worst case counts"
    )
    settled_at = models.DateTimeField(null=True, blank=True)
    removed_at = models.DateTimeField(
        null=True,
        blank=True,
        help_text="its messages and its answer were removed for their age; the numbers stay",
    )
    cached_tokens = models.PositiveIntegerField(
        null=True, blank=True, help_text="so many of the prompt's came from the endpoint's cache"
    )

    class Meta:
        ordering = ("number",)
        constraints = (
            models.UniqueConstraint(name="call_number_is_unique", fields=("attempt", "number")),
            models.UniqueConstraint(
                name="call_number_of_a_reading_is_unique", fields=("reading", "number")
            ),
            models.UniqueConstraint(
                name="call_number_of_a_judgement_is_unique", fields=("judgement", "number")
            ),
            models.CheckConstraint(
                name="call_has_one_owner",
                condition=Q(attempt__isnull=False, reading=None, judgement=None)
                | Q(attempt=None, reading__isnull=False, judgement=None)
                | Q(attempt=None, reading=None, judgement__isnull=False),
            ),
        )

    @property
    def is_cached(self) -> bool:
        """True if it was answered from the store."""
        return self.served_from_id is not None

    @property
    def reserved_usd(self) -> Decimal | None:
        """The worst case, None where the price is unknown."""
        return None if self.reserved_nano_usd is None else to_usd(self.reserved_nano_usd)

    @property
    def cost_usd(self) -> Decimal | None:
        """Cost, None while in flight or if the price is unknown."""
        return None if self.cost_nano_usd is None else to_usd(self.cost_nano_usd)


class TranscriptNote(models.Model):
    """Event between two calls of an attempt: a round, a tool, a review."""

    attempt = models.ForeignKey(Attempt, on_delete=models.CASCADE, related_name="notes")
    number = models.PositiveIntegerField()
    after_call = models.PositiveIntegerField(help_text="0 before the first call")
    kind = models.CharField(max_length=20, help_text="round, tool_call, review, kept")
    document = models.JSONField()

    class Meta:
        ordering = ("number",)
        constraints = (
            models.UniqueConstraint(name="note_number_is_unique", fields=("attempt", "number")),
        )


class Simulation(Work):
    """One closed-loop drive: scenario x what was changed x planner and its options.

    The scene as it was and with its reference is driven once for all jobs; each augmentation and
    each value of a sweep has drives of its own.
    """

    class Subject(models.TextChoices):
        UNMODIFIED = "unmodified", "Unmodified scene"
        REFERENCE = "reference", "Reference"
        AUGMENTATION = "augmentation", "Augmentation"
        SWEPT = "swept", "Value of a sweep"

    State = DoneState

    OF_SCENES = Q(augmentation=None, swept=None)
    """Drives of scenes as they were and with their references."""

    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="simulations")
    augmentation = models.ForeignKey(
        Augmentation, null=True, blank=True, on_delete=models.CASCADE, related_name="simulations"
    )
    swept = models.ForeignKey(
        SweepValue, null=True, blank=True, on_delete=models.CASCADE, related_name="drives"
    )
    subject = models.CharField(max_length=20, choices=Subject.choices)
    planner = models.CharField(max_length=120, help_text="pdm-closed, idm, or a dotted path")
    offsets = models.CharField(max_length=20, help_text="paper or original; of PDM-Closed")
    is_reactive = models.BooleanField(
        default=False, help_text="recorded vehicles answer to the ego instead of being replayed"
    )
    version = models.PositiveSmallIntegerField(
        default=1, help_text="of the rules by which others move; rows without are of the first"
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
                fields=("augmentation", "planner", "offsets", "is_reactive", "version"),
                condition=Q(augmentation__isnull=False),
            ),
            models.UniqueConstraint(
                name="one_drive_of_a_scene",
                fields=("scenario", "subject", "planner", "offsets", "is_reactive", "version"),
                condition=Q(augmentation=None, swept=None),
            ),
            models.UniqueConstraint(
                name="one_drive_of_a_swept_value",
                fields=("swept", "planner", "offsets", "is_reactive", "version"),
                condition=Q(swept__isnull=False),
            ),
            models.CheckConstraint(
                name="drive_names_its_subject",
                condition=(
                    Q(subject="augmentation", augmentation__isnull=False, swept=None)
                    | Q(subject="swept", augmentation=None, swept__isnull=False)
                    | Q(subject__in=("unmodified", "reference"), augmentation=None, swept=None)
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


class NuplanResult(models.Model):
    """An augmentation as nuPlan's own simulation drove it elsewhere; never a drive of ours."""

    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.CASCADE, related_name="nuplan_results"
    )
    planner = models.CharField(max_length=120, help_text="as it calls itself in nuPlan")
    rules = models.CharField(max_length=10, help_text="whose score it is: nuplan or interplan")
    score = models.FloatField(null=True, blank=True, help_text="0 to 1; none where it failed")
    reason = models.CharField(max_length=300, blank=True, help_text="why the simulation failed")
    parts = models.JSONField(default=dict, help_text="score by metric")
    read_at = models.DateTimeField(auto_now=True)

    class Meta:
        ordering = ("augmentation", "planner", "rules")
        constraints = (
            models.UniqueConstraint(
                name="one_nuplan_result_a_planner", fields=("augmentation", "planner", "rules")
            ),
            models.CheckConstraint(
                name="nuplan_result_is_a_score_or_a_reason",
                condition=Q(rules__in=["nuplan", "interplan"])
                & (Q(score__gte=0.0, score__lte=1.0, reason="") | (Q(score=None) & ~Q(reason=""))),
            ),
        )

    def __str__(self) -> str:
        return f"{self.augmentation} by {self.planner}"
