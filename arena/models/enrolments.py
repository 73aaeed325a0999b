"""Links by which people who have no account yet take part in a study."""

from __future__ import annotations

import hashlib
import secrets
import uuid

from django.conf import settings
from django.db import models
from django.db.models import Q

from arena.models.studies import Study
from arena.models.tokens import fresh_token

_SIGNS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
"""None that is taken for another one: a code may be typed from paper."""


def fresh_completion_code() -> str:
    """Ten signs that nobody can guess."""
    return "".join(secrets.choice(_SIGNS) for _ in range(10))


class Enrolment(models.Model):
    """One link for everybody who wants to take part in a study, up to so many.

    Its token is no secret of anybody: it gives a place, never somebody's account. It is kept as it
    is, so that it can be shown again.
    """

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    study = models.OneToOneField(Study, on_delete=models.CASCADE, related_name="enrolment")
    token = models.CharField(max_length=40, unique=True, default=fresh_token)
    consent = models.TextField(help_text="what people agree to before they take part")
    asks_for = models.CharField(
        max_length=120, help_text="what the form calls the id that people enter"
    )
    places = models.PositiveIntegerField(help_text="so many may take part at once")
    votes_each = models.PositiveIntegerField(help_text="the quota of everybody who enrols")
    drop_out_after_h = models.PositiveIntegerField(
        null=True,
        blank=True,
        help_text="who is silent for so long and not done loses the place; none: nobody does",
    )
    is_open = models.BooleanField(default=True)
    made_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.CheckConstraint(
                name="enrolment_has_places", condition=Q(places__gte=1, votes_each__gte=1)
            ),
        )

    def __str__(self) -> str:
        return str(self.code)

    @property
    def consent_sha256(self) -> str:
        """Of the text as it is now."""
        return hashlib.sha256(self.consent.encode()).hexdigest()


class EnrolledVoter(models.Model):
    """Somebody who took a place, and what is needed to thank or pay them."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    enrolment = models.ForeignKey(Enrolment, on_delete=models.CASCADE, related_name="voters")
    expert = models.OneToOneField(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="enrolled"
    )
    external_id = models.CharField(max_length=120, help_text="a name, or the id at a platform")
    consent_sha256 = models.CharField(max_length=64, help_text="of the text that was agreed to")
    completion_code = models.CharField(
        max_length=20, unique=True, default=fresh_completion_code, editable=False
    )
    enrolled_at = models.DateTimeField(auto_now_add=True)
    dropped_at = models.DateTimeField(
        null=True, blank=True, help_text="when the place was given on; votes given stay"
    )

    class Meta:
        ordering = ("enrolled_at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_place_per_external_id",
                fields=("enrolment", "external_id"),
                condition=~Q(external_id=""),
            ),
        )

    def __str__(self) -> str:
        return str(self.code)
