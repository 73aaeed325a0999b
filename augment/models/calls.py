"""Calls to language models."""

from __future__ import annotations

import uuid

from django.db import models

from augment.models.jobs import Attempt


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
