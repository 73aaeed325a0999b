"""Scenes and scenarios: what contestants are asked to change."""

from __future__ import annotations

import uuid

from django.db import models
from django.db.models import Q

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
