"""Contestants and the endpoints of their models."""

import re
import uuid

from django.core.exceptions import ValidationError
from django.db import models
from django.db.models import Q

from augment.models.scenes import SLUG_HELP
from augment.models.work import CodedModel, DoneState, Work, account_column
from augment.variants.recipes import spell_variant


class Endpoint(CodedModel):
    """An OpenAI-compatible address. The key itself is never stored, only where to find it."""

    label = models.SlugField(max_length=80, unique=True, help_text=SLUG_HELP)
    base_url = models.CharField(max_length=200, help_text="for example https://api.openai.com/v1")
    key_variable = models.CharField(
        max_length=80,
        blank=True,
        help_text="the environment variable that holds the key; empty where none is needed",
    )
    is_simulated = models.BooleanField(
        default=False, help_text="the project's own stand-in: what it answers counts as simulated"
    )
    max_concurrency = models.PositiveSmallIntegerField(
        default=4, help_text="so many calls may be under way at once, over all workers"
    )
    requests_per_minute = models.PositiveIntegerField(
        null=True,
        blank=True,
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


class KeyBinding(models.Model):
    """A server that a key may go to, written once by the upgrade that began to bind keys."""

    variable = models.CharField(max_length=80)
    server = models.CharField(max_length=300, help_text="host:port")

    class Meta:
        constraints = (
            models.UniqueConstraint(name="a_key_is_bound_once", fields=("variable", "server")),
        )

    def __str__(self) -> str:
        return f"{self.variable}={self.server}"


class EndpointModel(CodedModel):
    """Facts about one model at one endpoint. Unknown is null, never guessed, never zero."""

    class ModelClass(models.TextChoices):
        FRONTIER = "frontier", "Frontier"
        UTILITY = "utility", "Utility"
        OPEN_WEIGHT = "open_weight", "Open weight"

    endpoint = models.ForeignKey(Endpoint, on_delete=models.CASCADE, related_name="models")
    model = models.CharField(max_length=120, help_text="the model id on the endpoint")
    model_class = models.CharField(max_length=20, choices=ModelClass.choices, blank=True)
    native_tools = models.BooleanField(null=True, blank=True)
    vision = models.BooleanField(null=True, blank=True)
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
    price_cached_usd = models.DecimalField(
        max_digits=12, decimal_places=6, null=True, blank=True, help_text="as in; empty: the same"
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
        """A price is 0 or more and needs its other half, a date and a source.

        Raises:
            ValidationError: It is not, or one of them is missing.
        """
        prices = (self.price_in_usd, self.price_out_usd, self.price_cached_usd)
        if prices == (None, None, None):
            return
        if min(price or 0 for price in prices) < 0:
            raise ValidationError({"price_in_usd": "a price is 0 or more"})
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


class Contestant(CodedModel):
    """Contestants and the endpoints of their models."""

    class Kind(models.TextChoices):
        REFERENCE = "reference", "Reference"
        HUMAN = "human", "Human"
        LLM = "llm", "Language model"
        RULE = "rule", "Rules"
        BASELINE = "baseline", "Baseline"
        SIMULATED = "simulated", "Simulated"
        SUBMISSION = "submission", "Submission"
        CHECK = "check", "Attention check"

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
    card = models.JSONField(
        null=True,
        blank=True,
        editable=False,
        help_text="of a submission: who made it and how; only results show it; null for others",
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
                        "submission",
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
                name="contestant_with_card_is_submission",
                condition=Q(card__isnull=True) | Q(kind="submission", endpoint=None),
            ),
            models.CheckConstraint(
                name="contestant_with_error_rates_is_simulated",
                condition=Q(error_rates__isnull=True) | Q(kind="simulated", endpoint=None),
            ),
        )

    def __str__(self) -> str:
        return self.name

    @property
    def way(self) -> str:
        """Variant, model and endpoint in words; empty where it asks no model."""
        variant = spell_variant(self.variant)
        return f"{variant} with {self.model} at {self.endpoint}" if self.endpoint else ""

    @property
    def name_note(self) -> str:
        """Sentence on a name from before `fc` was the paper's function; mostly empty."""
        words = f"{self.slug} {self.name}".lower()
        if not (self.variant.startswith("fc-plus") and re.search(r"\bfc\b(?!-plus)", words)):
            return ""
        now = spell_variant(self.variant)
        before = now.replace("-plus", "")
        return f"{self.name} runs {now}: it was named before {before} meant the paper’s function."

    @property
    def is_simulated(self) -> bool:
        """True if it must never mix into a rating unless somebody switched that on."""
        return self.kind == self.Kind.SIMULATED


class Probe(Work):
    """One round of questions to a model; its last report is also kept with the model."""

    State = DoneState

    model = models.ForeignKey(EndpointModel, on_delete=models.CASCADE, related_name="probes")
    state = models.CharField(max_length=20, choices=State.choices, default=State.QUEUED)
    findings = models.JSONField(default=list, help_text="one a question, as far as they are asked")
    asked_by = account_column()

    class Meta:
        ordering = ("-created_at", "-pk")
        constraints = (
            models.UniqueConstraint(
                name="one_probe_under_way_at_a_model",
                fields=("model",),
                condition=models.Q(state__in=("queued", "running")),
            ),
        )
