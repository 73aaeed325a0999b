"""Calls to language models, and what was made of them."""

from __future__ import annotations

import uuid
from decimal import Decimal

from django.db import models
from django.db.models import Q

from augment.llm.costs import usd_of
from augment.models.jobs import Attempt, IntentReading


class ModelCall(models.Model):
    """One request to a language model and its raw answer, stored before anybody reads it.

    Unknown is null, never zero. A call with `served_from` was answered from the store: it costs
    nothing and counts for nothing. Until `settled_at` the call is in flight, and the reservation
    is part of its job's. Before `sent_at` nothing of it has left this computer.
    """

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
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
    number = models.PositiveIntegerField()
    role = models.CharField(
        max_length=20, help_text="modifier, reviewer, engineer, viewer, reader"
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

    class Meta:
        ordering = ("number",)
        constraints = (
            models.UniqueConstraint(name="call_number_is_unique", fields=("attempt", "number")),
            models.UniqueConstraint(
                name="call_number_of_a_reading_is_unique", fields=("reading", "number")
            ),
            models.CheckConstraint(
                name="call_is_an_attempts_or_a_readings",
                condition=Q(attempt__isnull=True) ^ Q(reading__isnull=True),
            ),
        )

    def __str__(self) -> str:
        return f"call {self.number}"

    @property
    def is_cached(self) -> bool:
        """Whether it was answered from the store."""
        return self.served_from_id is not None

    @property
    def reserved_usd(self) -> Decimal | None:
        """The worst case, None where the price is unknown."""
        return None if self.reserved_nano_usd is None else usd_of(self.reserved_nano_usd)

    @property
    def cost_usd(self) -> Decimal | None:
        """What it cost, None while in flight or where the price is unknown."""
        return None if self.cost_nano_usd is None else usd_of(self.cost_nano_usd)


class TranscriptNote(models.Model):
    """What happened between two calls of an attempt: a round, a tool, a review."""

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

    def __str__(self) -> str:
        return f"{self.kind} after call {self.after_call}"
