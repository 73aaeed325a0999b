"""Endpoints, what their models can do and cost, and the calls that are under way at them."""

from __future__ import annotations

import re
import uuid

from django.core.exceptions import ValidationError
from django.core.validators import MinValueValidator
from django.db import models
from django.db.models import Q

from augment.errors import InvalidDocument
from augment.llm.addresses import check_base_url
from augment.models.scenes import SLUG_HELP

NOT_A_VARIABLE = "the name of an environment variable is needed, not the key"


def is_served_from(base_url: str) -> None:
    """Refuse an address that no model is served from.

    Raises:
        ValidationError: It is none, it carries a secret, or it leads to a link-local or metadata
            address.
    """
    try:
        check_base_url(base_url)
    except InvalidDocument as error:
        raise ValidationError([problem for _, problem in error.problems]) from error


def names_a_variable(name: str) -> None:
    """Refuse what can't be the name of an environment variable.

    Raises:
        ValidationError: It can't; the value is not repeated, because it may be the key itself.
    """
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,79}", name):
        raise ValidationError(NOT_A_VARIABLE)


class Endpoint(models.Model):
    """An OpenAI-compatible address. The key itself is never stored, only where to find it."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    label = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    base_url = models.CharField(
        max_length=200,
        validators=[is_served_from],
        help_text="for example https://api.openai.com/v1",
    )
    key_variable = models.CharField(
        max_length=80,
        blank=True,
        validators=[names_a_variable],
        help_text="the environment variable that holds the key; empty where none is needed",
    )
    is_simulated = models.BooleanField(
        default=False, help_text="the project's own stand-in: what it answers counts as simulated"
    )
    max_concurrency = models.PositiveSmallIntegerField(
        default=4,
        validators=[MinValueValidator(1)],
        help_text="so many calls may be under way at once, over all workers",
    )
    requests_per_minute = models.PositiveIntegerField(
        null=True,
        blank=True,
        validators=[MinValueValidator(1)],
        help_text="so many calls may start within a minute, over all workers; empty: no limit",
    )

    class Meta:
        ordering = ("label",)
        constraints = (
            models.CheckConstraint(
                name="endpoint_lets_somebody_in",
                condition=Q(max_concurrency__gte=1)
                & (Q(requests_per_minute=None) | Q(requests_per_minute__gte=1)),
            ),
        )

    def __str__(self) -> str:
        return self.label

    def clean(self) -> None:
        """Write the address as services do, without a slash at its end."""
        self.base_url = self.base_url.rstrip("/")


class EndpointModel(models.Model):
    """What is known of one model at one endpoint. Unknown is null, never guessed, never zero."""

    class ModelClass(models.TextChoices):
        FRONTIER = "frontier", "Frontier"
        UTILITY = "utility", "Utility"
        OPEN_WEIGHT = "open_weight", "Open weight"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    endpoint = models.ForeignKey(Endpoint, on_delete=models.CASCADE, related_name="models")
    model = models.CharField(max_length=120, help_text="the model id on the endpoint")
    model_class = models.CharField(max_length=20, choices=ModelClass.choices, blank=True)
    native_tools = models.BooleanField(null=True, blank=True)
    vision = models.BooleanField(null=True, blank=True)
    json_schema = models.BooleanField(null=True, blank=True)
    temperature = models.BooleanField(null=True, blank=True, help_text="may be chosen")
    refused_parameters = models.JSONField(
        default=list, blank=True, help_text="what it answered 400 to and is not sent again"
    )
    reasoning_effort = models.CharField(
        max_length=20, blank=True, help_text="sent as it stands; empty: not sent"
    )
    context_tokens = models.PositiveIntegerField(null=True, blank=True)
    max_output_tokens = models.PositiveIntegerField(null=True, blank=True)
    price_in_usd = models.DecimalField(
        max_digits=12, decimal_places=6, null=True, blank=True, help_text="per million tokens"
    )
    price_out_usd = models.DecimalField(
        max_digits=12, decimal_places=6, null=True, blank=True, help_text="per million tokens"
    )
    price_as_of = models.DateField(null=True, blank=True)
    price_source = models.CharField(max_length=200, blank=True)
    probed_at = models.DateTimeField(null=True, blank=True)
    probe_report = models.JSONField(null=True, blank=True)

    class Meta:
        ordering = ("endpoint__label", "model")
        constraints = (
            models.UniqueConstraint(
                name="one_row_per_endpoint_and_model", fields=("endpoint", "model")
            ),
            models.CheckConstraint(
                name="model_class_is_known",
                condition=Q(model_class__in=["", "frontier", "utility", "open_weight"]),
            ),
            models.CheckConstraint(
                name="price_is_whole_and_not_negative",
                condition=Q(price_in_usd=None, price_out_usd=None)
                | Q(
                    price_in_usd__isnull=False,
                    price_out_usd__isnull=False,
                    price_in_usd__gte=0,
                    price_out_usd__gte=0,
                ),
            ),
            models.CheckConstraint(
                name="model_takes_and_gives_tokens",
                condition=(Q(context_tokens=None) | Q(context_tokens__gte=1))
                & (Q(max_output_tokens=None) | Q(max_output_tokens__gte=1)),
            ),
        )

    def __str__(self) -> str:
        return f"{self.model} at {self.endpoint}"

    def clean(self) -> None:
        """A price needs its other half, a date and a source.

        Raises:
            ValidationError: One of them is missing.
        """
        if self.price_in_usd is None and self.price_out_usd is None:
            return
        needed = ("price_in_usd", "price_out_usd", "price_as_of", "price_source")
        missing = [name for name in needed if getattr(self, name) in (None, "")]
        if missing:
            problem = "a price needs both halves, a date and a source"
            raise ValidationError(dict.fromkeys(missing, problem))


class CallLease(models.Model):
    """The right to have one call under way at an endpoint, as long as it is renewed."""

    endpoint = models.ForeignKey(Endpoint, on_delete=models.CASCADE, related_name="leases")
    token = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    started_at = models.DateTimeField()
    expires_at = models.DateTimeField(help_text="a worker that died renews nothing")
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("started_at",)
        indexes = (
            models.Index(fields=("endpoint", "started_at")),
            models.Index(fields=("endpoint", "finished_at", "expires_at")),
        )

    def __str__(self) -> str:
        return str(self.token)
