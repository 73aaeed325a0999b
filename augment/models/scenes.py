"""Scenes and scenarios: what contestants are asked to change."""

from typing import Any

from django.db import models
from django.db.models import Q

from augment.models.work import CodedModel, SentFile, Work, account_column
from augment.scene.entities import CatalogueSet, ScenarioType, TrafficDensity, TurnType
from augment.scene.intent import IntentOrigin

DENSITIES = tuple(TrafficDensity)
GOALS = (TurnType.LEFT, TurnType.RIGHT, TurnType.STRAIGHT)
RETIRED_HELP = "since when forms offer it no more"
SLUG_HELP = "lower-case letters, digits and hyphens"


class BaseScene(CodedModel):
    """A recorded or authored scene at t0, before anybody changed it."""

    slug = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    document = models.JSONField(help_text="the scene in augment.scene.codec's format")
    recording = models.JSONField(null=True, blank=True, help_text="tracks and ego motion after t0")
    source = models.CharField(max_length=40, help_text="authored, av2, ...")
    source_item = models.CharField(
        max_length=200, blank=True, help_text="which part of its source; nuPlan's base token"
    )
    provenance = models.TextField()
    notes = models.JSONField(
        default=list,
        blank=True,
        help_text="losses and assumptions, as augment.scene.recording has them",
    )
    content_hash = models.CharField(
        max_length=64,
        blank=True,
        db_index=True,
        help_text="of what was read from outside; two scenes of one hash are the same",
    )
    retired_at = models.DateTimeField(null=True, blank=True, help_text=RETIRED_HELP)
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug",)

    def __str__(self) -> str:
        return self.slug


class Scenario(CodedModel):
    """A scene, its type, the user's instruction; its intent and reference if there are any."""

    SETS = tuple(entry.value for entry in CatalogueSet)
    """The parts of the authored catalogue, by name."""

    slug = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    base_scene = models.ForeignKey(BaseScene, on_delete=models.PROTECT, related_name="scenarios")
    type = models.CharField(
        max_length=40, help_text="one of the paper's five, or a slug of your own: cut_in"
    )
    type_label = models.CharField(
        max_length=60, blank=True, help_text="of a type of your own; empty for the paper's five"
    )
    instruction = models.TextField()
    reference = models.JSONField(
        null=True, blank=True, help_text="the human modification, in augment.scene.codec's format"
    )
    intent = models.JSONField(
        null=True,
        blank=True,
        help_text="what the instruction asks for, in augment.scene.codec's format",
    )
    intent_origin = models.CharField(
        max_length=10, choices=[(entry.value, entry.value) for entry in IntentOrigin], blank=True
    )
    keep_traffic = models.BooleanField(
        default=False, help_text="keep the recorded traffic; interPlan clears it"
    )
    traffic_density = models.CharField(
        max_length=10,
        default=TrafficDensity.NONE.value,
        choices=[(entry.value, entry.value) for entry in TrafficDensity],
        help_text="of the traffic spawned in place of the recorded one",
    )
    goal = models.CharField(
        max_length=10,
        blank=True,
        choices=[(entry.value, entry.value) for entry in GOALS],
        help_text="where the ego's way turns; empty for the recorded or straightest way",
    )
    spawned = models.JSONField(
        null=True, blank=True, help_text="the spawned traffic, as a modification that adds it"
    )
    interplan = models.JSONField(
        null=True,
        blank=True,
        help_text="the special scenario in interPlan's file: index, entry, details, file",
    )
    instruction_is_generated = models.BooleanField(
        default=False, help_text="made from the reference, not written by a person"
    )
    catalogue_set = models.CharField(
        max_length=10,
        blank=True,
        db_index=True,
        choices=[(entry.value, entry.value) for entry in CatalogueSet],
        help_text="the part of the authored catalogue that it belongs to; empty for all others",
    )
    language = models.CharField(max_length=2, default="en", help_text="of the instruction")
    paraphrase_of = models.ForeignKey(
        "self",
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="paraphrases",
        help_text="the scenario that it asks for in other words",
    )
    follows = models.ForeignKey(
        "self",
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="follow_ups",
        help_text="the scenario whose results its instruction asks to change further",
    )
    origin = models.UUIDField(
        null=True,
        editable=False,
        db_index=True,
        help_text="code of the scenario that it goes back to: as a variant, a copy, other words "
        "or a follow-up; its own code for all others",
    )
    original_image = models.CharField(
        max_length=120, blank=True, help_text="name of the picture before any change"
    )
    windows = models.JSONField(
        default=dict,
        blank=True,
        help_text="by key of a window that was drawn: original image and view",
    )
    retired_at = models.DateTimeField(null=True, blank=True, help_text=RETIRED_HELP)
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug",)
        constraints = (
            models.CheckConstraint(
                name="scenario_type_of_ones_own_has_a_label",
                condition=Q(type__in=[entry.value for entry in ScenarioType], type_label="")
                | (
                    ~Q(type__in=[entry.value for entry in ScenarioType])
                    & ~Q(type="")
                    & ~Q(type_label="")
                ),
            ),
            models.CheckConstraint(
                name="scenario_intent_has_an_origin",
                condition=Q(intent__isnull=True, intent_origin="")
                | Q(
                    intent__isnull=False,
                    intent_origin__in=[member.value for member in IntentOrigin],
                ),
            ),
        )

    def __str__(self) -> str:
        return self.slug

    def save(self, *args: Any, **kwargs: Any) -> None:
        """Store the row; a new one goes back to where the one that it names goes back to."""
        if self.origin is None:
            before = self.paraphrase_of or self.follows
            self.origin = self.code if before is None else before.origin
        super().save(*args, **kwargs)

    @property
    def in_catalogue(self) -> bool:
        """True if it comes with the project; then only its file changes it."""
        return bool(self.catalogue_set)

    @property
    def is_open(self) -> bool:
        """True if its wish is a purpose; the reference is then an example, not a measure."""
        return bool((self.intent or {}).get("purpose"))

    @property
    def followed(self) -> "list[Scenario]":
        """Scenarios before it in a conversation, the first one first.

        Each once, also where an imported folder leads in a circle.
        """
        chain: list[Scenario] = []
        before = self.follows
        while before is not None and before not in (self, *chain):
            chain.insert(0, before)
            before = before.follows
        return chain

    @property
    def wording(self) -> str:
        """The instruction; of a follow-up all that was said up to it, a numbered line each."""
        wishes = [*(before.instruction for before in self.followed), self.instruction]
        if len(wishes) == 1:
            return self.instruction
        return "\n".join(f"{number}. {text}" for number, text in enumerate(wishes, start=1))

    def get_type_display(self) -> str:
        """Return the label of its type."""
        return self.type_label or ScenarioType(self.type).label


class SceneUpload(SentFile):
    """A recording as it came; a worker finds out what it is and what it holds."""

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        READ = "read", "Read"
        FAILED = "failed", "Failed"

    asked_format = models.CharField(max_length=40, blank=True, help_text="empty to recognise it")
    format = models.CharField(max_length=40, blank=True, help_text="as it was read")
    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    tracks = models.JSONField(
        default=list, blank=True, help_text="parts with moments, as services.scenarios.uploads"
    )
    is_cut = models.BooleanField(default=False, help_text="it holds more than is offered")

    class Meta:
        ordering = ("-pk",)
        constraints = (
            models.CheckConstraint(
                name="upload_state_is_known",
                condition=Q(state__in=["queued", "running", "read", "failed"]),
            ),
        )


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
    asked_by = account_column(on_delete=models.SET_NULL)

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
