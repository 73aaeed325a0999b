"""Addresses that are told when something happens, and what they were told."""

from __future__ import annotations

import uuid
from typing import Any

from django.conf import settings
from django.db import models
from django.db.models import Q

from arena.models.tokens import fresh_token


class Webhook(models.Model):
    """One address. Its secret is not stored: it is made of the salt and the installation's key."""

    class What(models.TextChoices):
        JOB_FINISHED = "job.finished", "Job finished"
        BUDGET_HIT = "job.budget_hit", "Budget hit"
        STUDY_CLOSED = "study.closed", "Study closed"
        SNAPSHOT_FROZEN = "snapshot.frozen", "Snapshot frozen"
        TEST = "test", "Test"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    name = models.CharField(max_length=80)
    url = models.CharField(max_length=500)
    events: Any = models.JSONField(default=list, help_text="what it is told of")
    salt = models.CharField(max_length=40, default=fresh_token, editable=False)
    is_active = models.BooleanField(default=True)
    made_by = models.ForeignKey(
        settings.AUTH_USER_MODEL, null=True, on_delete=models.SET_NULL, related_name="webhooks"
    )
    made_at = models.DateTimeField(auto_now_add=True)
    looked_at = models.DateTimeField(
        null=True, help_text="until when was looked for what it has to be told"
    )

    class Meta:
        ordering = ("name", "pk")

    def __str__(self) -> str:
        return self.name


class WebhookDelivery(models.Model):
    """One message to one address; tried until it is answered with 2xx or given up."""

    class State(models.TextChoices):
        WAITING = "waiting", "Waiting"
        DELIVERED = "delivered", "Delivered"
        FAILED = "failed", "Given up"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    webhook = models.ForeignKey(Webhook, on_delete=models.CASCADE, related_name="deliveries")
    event = models.CharField(max_length=40, choices=Webhook.What.choices)
    occurrence = models.CharField(
        max_length=120, help_text="what happened, once for all: a code and when"
    )
    body = models.TextField(help_text="as it is sent, so that every try has the same bytes")
    state = models.CharField(max_length=10, choices=State.choices, default=State.WAITING)
    attempts = models.PositiveSmallIntegerField(default=0)
    due_at = models.DateTimeField(help_text="when it is tried next, by whichever worker is first")
    last_status = models.PositiveSmallIntegerField(null=True, blank=True)
    last_answer = models.CharField(max_length=300, blank=True)
    made_at = models.DateTimeField(auto_now_add=True)
    ended_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.UniqueConstraint(
                name="one_delivery_of_each", fields=("webhook", "event", "occurrence")
            ),
            models.CheckConstraint(
                name="delivery_state_is_known",
                condition=Q(state__in=["waiting", "delivered", "failed"]),
            ),
        )
        indexes = (models.Index(fields=("state", "due_at"), name="delivery_due"),)

    def __str__(self) -> str:
        return str(self.code)
