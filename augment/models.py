"""Rows of augment: scenes, scenarios, contestants, jobs and what they produced.

Rows are the truth; a Celery message carries one id. Every row that a person can see in a URL has
a random `code`; primary keys stay inside.
"""

from __future__ import annotations

import uuid
from typing import Any

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from augment.scene.catalogue import ScenarioType

SLUG_HELP = "lower-case letters, digits and hyphens"


class BaseScene(models.Model):
    """A recorded or authored scene at t0, before anybody changed it."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    slug = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    document = models.JSONField(help_text="the scene in augment.scene.codec's format")
    recording = models.JSONField(null=True, blank=True, help_text="tracks and ego motion after t0")
    source = models.CharField(max_length=40, help_text="authored, av2, ...")
    provenance = models.TextField()
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug",)

    def __str__(self) -> str:
        return self.slug


class Scenario(models.Model):
    """A scene, its type, the user's instruction and, if there is one, the reference."""

    class Type(models.TextChoices):
        CONSTRUCTION_ZONE = (
            ScenarioType.CONSTRUCTION_ZONE.value,
            ScenarioType.CONSTRUCTION_ZONE.label,
        )
        ACCIDENT_SITE = ScenarioType.ACCIDENT_SITE.value, ScenarioType.ACCIDENT_SITE.label
        JAYWALKER = ScenarioType.JAYWALKER.value, ScenarioType.JAYWALKER.label
        NUDGE = ScenarioType.NUDGE.value, ScenarioType.NUDGE.label
        OVERTAKE = ScenarioType.OVERTAKE.value, ScenarioType.OVERTAKE.label

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    slug = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    base_scene = models.ForeignKey(BaseScene, on_delete=models.PROTECT, related_name="scenarios")
    type = models.CharField(max_length=40, choices=Type.choices)
    instruction = models.TextField()
    reference = models.JSONField(
        null=True, blank=True, help_text="the human modification, in augment.scene.codec's format"
    )
    keep_traffic = models.BooleanField(
        default=False, help_text="keep the recorded traffic; interPlan clears it"
    )
    in_catalogue = models.BooleanField(default=False)
    original_image = models.CharField(
        max_length=120, blank=True, help_text="name of the picture before any change"
    )
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug",)
        constraints = (
            models.CheckConstraint(
                name="scenario_type_is_known",
                condition=Q(type__in=[member.value for member in ScenarioType]),
            ),
        )

    def __str__(self) -> str:
        return self.slug


class Endpoint(models.Model):
    """An OpenAI-compatible address. The key itself is never stored, only where to find it."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    label = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    base_url = models.URLField(help_text="for example https://api.openai.com/v1")
    key_variable = models.CharField(
        max_length=80,
        blank=True,
        help_text="the environment variable that holds the key; empty where none is needed",
    )
    is_simulated = models.BooleanField(
        default=False, help_text="the project's own stand-in: what it answers counts as simulated"
    )

    class Meta:
        ordering = ("label",)

    def __str__(self) -> str:
        return self.label


class Contestant(models.Model):
    """Who is rated."""

    class Kind(models.TextChoices):
        REFERENCE = "reference", "Reference"
        HUMAN = "human", "Human"
        LLM = "llm", "Language model"
        RULE = "rule", "Rules"
        BASELINE = "baseline", "Baseline"
        SIMULATED = "simulated", "Simulated"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    slug = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    name = models.CharField(max_length=120)
    kind = models.CharField(max_length=20, choices=Kind.choices)
    variant = models.CharField(max_length=20, blank=True, help_text="otm, fc, ...; empty without")
    endpoint = models.ForeignKey(
        Endpoint, null=True, blank=True, on_delete=models.PROTECT, related_name="contestants"
    )
    model = models.CharField(max_length=120, blank=True, help_text="the model id on the endpoint")
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug",)
        constraints = (
            models.CheckConstraint(
                name="contestant_kind_is_known",
                condition=Q(
                    kind__in=["reference", "human", "llm", "rule", "baseline", "simulated"]
                ),
            ),
            models.CheckConstraint(
                name="contestant_variant_has_endpoint_and_model",
                condition=Q(variant="", endpoint=None, model="")
                | (~Q(variant="") & Q(endpoint__isnull=False) & ~Q(model="")),
            ),
        )

    def __str__(self) -> str:
        return self.name

    @property
    def is_simulated(self) -> bool:
        """Whether it must never mix into a rating unless somebody switched that on."""
        return self.kind == self.Kind.SIMULATED


class GenerationJob(models.Model):
    """Contestants x scenarios, launched by an admin."""

    class State(models.TextChoices):
        RUNNING = "running", "Running"
        CANCELLED = "cancelled", "Cancelled"
        FINISHED = "finished", "Finished"

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
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("-created_at", "-pk")

    def __str__(self) -> str:
        return self.name


class Augmentation(models.Model):
    """One row of a job: scenario x contestant -> modification, image, and why not if not.

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

    UNDER_WAY = (State.QUEUED, State.RUNNING)

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    job = models.ForeignKey(GenerationJob, on_delete=models.CASCADE, related_name="augmentations")
    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="augmentations")
    contestant = models.ForeignKey(
        Contestant, on_delete=models.PROTECT, related_name="augmentations"
    )
    state = models.CharField(max_length=20, choices=State.choices, default=State.QUEUED)
    modification = models.JSONField(null=True, blank=True)
    notes = models.TextField(blank=True, help_text="what the contestant said about its own work")
    reason = models.TextField(blank=True, help_text="why there is no modification")
    image = models.CharField(max_length=120, blank=True, help_text="name in the media storage")
    claim = models.UUIDField(null=True, blank=True, help_text="who works on it right now")
    heartbeat_at = models.DateTimeField(null=True, blank=True)
    sent_at = models.DateTimeField(null=True, blank=True, help_text="last put on the queue")
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("scenario__slug", "contestant__slug")
        constraints = (
            models.UniqueConstraint(
                name="one_augmentation_per_cell", fields=("job", "scenario", "contestant")
            ),
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


class ModelCall(models.Model):
    """One request to a language model and its raw answer, stored before anybody reads it.

    Unknown is null, never zero.
    """

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    attempt = models.ForeignKey(Attempt, on_delete=models.CASCADE, related_name="calls")
    number = models.PositiveIntegerField()
    role = models.CharField(max_length=20, help_text="modifier, reviewer, engineer, viewer")
    request = models.JSONField(help_text="model, messages and parameters, without the key")
    answer = models.TextField(null=True, blank=True, help_text="the raw text, null without one")
    fault = models.TextField(blank=True, help_text="what broke, if there was no answer")
    model_returned = models.CharField(max_length=120, blank=True)
    finish_reason = models.CharField(max_length=40, blank=True)
    prompt_version = models.CharField(max_length=64, blank=True)
    prompt_tokens = models.PositiveIntegerField(null=True, blank=True)
    completion_tokens = models.PositiveIntegerField(null=True, blank=True)
    started_at = models.DateTimeField()
    latency_s = models.FloatField(null=True, blank=True)

    class Meta:
        ordering = ("number",)
        constraints = (
            models.UniqueConstraint(name="call_number_is_unique", fields=("attempt", "number")),
        )

    def __str__(self) -> str:
        return f"call {self.number}"


class Event(models.Model):
    """One line of the append-only log: who did what to which object, when, before and after."""

    actor = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="events",
        help_text="null for the machine itself",
    )
    verb = models.CharField(max_length=60)
    object_kind = models.CharField(max_length=40)
    object_code = models.CharField(max_length=64)
    before = models.JSONField(null=True, blank=True)
    after = models.JSONField(null=True, blank=True)
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-at", "-pk")
        indexes = (models.Index(fields=("object_kind", "object_code")),)

    def __str__(self) -> str:
        return f"{self.verb} {self.object_kind} {self.object_code}"

    def save(self, *args: Any, **kwargs: Any) -> None:
        """Insert the line.

        Raises:
            TypeError: It is stored already; the log is append-only.
        """
        if not self._state.adding:
            raise TypeError("the event log is append-only; a line can't be changed")
        super().save(*args, **kwargs)

    def delete(self, *args: Any, **kwargs: Any) -> tuple[int, dict[str, int]]:
        """Never.

        Raises:
            TypeError: Always; the log is append-only.
        """
        raise TypeError("the event log is append-only; a line can't be deleted")
