"""Who is rated."""

from __future__ import annotations

import uuid

from django.db import models
from django.db.models import Q

from augment.models.contestants import Endpoint
from augment.models.scenes import SLUG_HELP


class Contestant(models.Model):
    """Who is rated."""

    class Kind(models.TextChoices):
        REFERENCE = "reference", "Reference"
        HUMAN = "human", "Human"
        LLM = "llm", "Language model"
        RULE = "rule", "Rules"
        BASELINE = "baseline", "Baseline"
        SIMULATED = "simulated", "Simulated"
        CHECK = "check", "Attention check"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    slug = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    name = models.CharField(max_length=120)
    kind = models.CharField(max_length=20, choices=Kind.choices)
    variant = models.CharField(max_length=20, blank=True, help_text="otm, fc, ...; empty without")
    endpoint = models.ForeignKey(
        Endpoint, null=True, blank=True, on_delete=models.PROTECT, related_name="contestants"
    )
    model = models.CharField(max_length=120, blank=True, help_text="the model id on the endpoint")
    roles = models.JSONField(
        default=dict,
        blank=True,
        help_text='who else plays a role: {"viewer": {"endpoint": label, "model": id}}',
    )
    error_rates = models.JSONField(
        null=True,
        blank=True,
        help_text='of simulated errors: {"position": 0.1, ...}; null for all others',
    )
    options = models.JSONField(
        default=dict,
        blank=True,
        help_text='chosen when it was added: {"temperature": 0.7}; what is open is not in it',
    )
    frozen_options = models.JSONField(
        null=True,
        blank=True,
        editable=False,
        help_text="the whole set with which it runs, fixed at its first run; null before",
    )
    sends = models.JSONField(
        null=True,
        blank=True,
        editable=False,
        help_text="by role, what its models were known to take when it first ran; null before",
    )
    created_at = models.DateTimeField(auto_now_add=True)
    retired_at = models.DateTimeField(
        null=True, blank=True, help_text="forms offer it no more; what it made stays"
    )

    class Meta:
        ordering = ("slug",)
        constraints = (
            models.CheckConstraint(
                name="contestant_kind_is_known",
                condition=Q(
                    kind__in=[
                        *("reference", "human", "llm", "rule", "baseline", "simulated"),
                        "check",  # nobody to be rated: its pictures are broken on purpose
                    ]
                ),
            ),
            models.CheckConstraint(
                name="contestant_variant_has_endpoint_and_model",
                condition=Q(variant="", endpoint=None, model="")
                | (~Q(variant="") & Q(endpoint__isnull=False) & ~Q(model="")),
            ),
            models.CheckConstraint(
                name="contestant_with_error_rates_is_simulated",
                condition=Q(error_rates__isnull=True) | Q(kind="simulated", endpoint=None),
            ),
        )

    def __str__(self) -> str:
        return self.name

    @property
    def is_simulated(self) -> bool:
        """Whether it must never mix into a rating unless somebody switched that on."""
        return self.kind == self.Kind.SIMULATED
