"""Participation in studies: links, enrolments, authorships, practice; and drafts."""

import hashlib
import secrets
from datetime import datetime
from typing import ClassVar

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from arena.models.people import fresh_token
from arena.models.studies import Study
from augment.models import (
    Augmentation,
    CodedModel,
    Contestant,
    Scenario,
    account_column,
    user_column,
)


class Invitation(CodedModel):
    """One link for one expert, from a study or from the page of people.

    Its token is sent once and kept only as a hash. A new link replaces the one before from the
    same place, and each can be taken back by itself.
    """

    class State(models.TextChoices):
        UNUSED = "unused", "Not opened yet"
        USED = "used", "Used"
        EXPIRED = "expired", "Expired"
        REVOKED = "revoked", "Taken back"

    ALIVE: ClassVar = frozenset({State.UNUSED, State.USED})

    study = models.ForeignKey(Study, models.CASCADE, related_name="invitations", null=True)
    expert = user_column("invitations", on_delete=models.CASCADE)
    token_sha256 = models.CharField(max_length=64, unique=True, editable=False)
    invited_by = account_column(
        on_delete=models.SET_NULL, help_text="none for a link that was made by the command"
    )
    made_at = models.DateTimeField(auto_now_add=True)
    expires_at = models.DateTimeField()
    used_at = models.DateTimeField(null=True, blank=True, help_text="when it first let in")
    revoked_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.UniqueConstraint(
                name="one_live_link_per_expert",
                fields=("study", "expert"),
                condition=Q(revoked_at=None),
            ),
        )

    def state(self, now: datetime) -> State:
        """Return whether the link works at that time, and if not, why."""
        if self.revoked_at is not None:
            return self.State.REVOKED
        if self.expires_at <= now:
            return self.State.EXPIRED
        return self.State.UNUSED if self.used_at is None else self.State.USED


def token_digest(token: str) -> str:
    """Return the stored digest of a token: 32 random bytes need no salt and no slow hash."""
    return hashlib.sha256(token.encode()).hexdigest()


_SIGNS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
"""None that is taken for another one: a code may be typed from paper."""


def fresh_completion_code() -> str:
    """Ten signs that nobody can guess."""
    return "".join(secrets.choice(_SIGNS) for _ in range(10))


class Enrolment(CodedModel):
    """One link for everybody who wants to take part in a study, up to so many.

    Its token is no secret of anybody: it gives a place, never somebody's account. It is kept as it
    is, so that it can be shown again.
    """

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
    completes_with = models.CharField(
        max_length=200, blank=True, help_text="a code or address for all; empty: each has a code"
    )
    made_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.CheckConstraint(
                name="enrolment_has_places", condition=Q(places__gte=1, votes_each__gte=1)
            ),
        )

    @property
    def consent_sha256(self) -> str:
        """SHA-256 of the consent text as it is now."""
        return hashlib.sha256(self.consent.encode()).hexdigest()


class EnrolledVoter(CodedModel):
    """Somebody who took a place, and what is needed to thank or pay them."""

    enrolment = models.ForeignKey(Enrolment, on_delete=models.CASCADE, related_name="voters")
    expert = models.OneToOneField(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="enrolled"
    )
    external_id = models.CharField(max_length=120, help_text="a name, or the id at a platform")
    platform_study = models.CharField(max_length=120, blank=True, help_text="Prolific's STUDY_ID")
    platform_session = models.CharField(max_length=120, blank=True, help_text="its SESSION_ID")
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


class Authorship(CodedModel):
    """An expert has a stake in a contestant of the study; no expert ever learns of it.

    What is taken back is deleted here and stays in the log.
    """

    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="authorships")
    expert = user_column("authorships", on_delete=models.CASCADE)
    contestant = models.ForeignKey(
        Contestant, on_delete=models.CASCADE, related_name="authorships"
    )
    marked_by = account_column(on_delete=models.SET_NULL, help_text="none where the command did")
    marked_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("marked_at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_authorship_each", fields=("study", "expert", "contestant")
            ),
        )


class PracticePair(models.Model):
    """A right picture beside one that is broken on purpose, shown to one expert for practice.

    The round is over once every pair of it has an answer; who skips the round answers all that
    are left with "skipped".
    """

    class Answer(models.TextChoices):
        LEFT = "left", "A is better"
        EQUAL = "equal", "Equal"
        RIGHT = "right", "B is better"
        SKIPPED = "skipped", "Skipped"

    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="practice_pairs")
    expert = user_column("practice_pairs", on_delete=models.CASCADE)
    position = models.PositiveIntegerField(help_text="place in the expert's round, from 1")
    scenario = models.ForeignKey(Scenario, on_delete=models.CASCADE, related_name="+")
    good = models.ForeignKey(Augmentation, on_delete=models.CASCADE, related_name="+")
    broken = models.ForeignKey(Augmentation, on_delete=models.CASCADE, related_name="+")
    good_is_left = models.BooleanField()
    left_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    right_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    answer = models.CharField(max_length=10, blank=True, choices=Answer.choices)

    class Meta:
        ordering = ("study", "expert", "position")
        constraints = (
            models.UniqueConstraint(
                name="one_practice_pair_per_position", fields=("study", "expert", "position")
            ),
            models.CheckConstraint(
                name="practice_shows_two_augmentations", condition=~Q(good=F("broken"))
            ),
            models.CheckConstraint(
                name="practice_answer_is_known",
                condition=Q(answer__in=["", "left", "equal", "right", "skipped"]),
            ),
        )

    @property
    def left(self) -> Augmentation:
        """Augmentation on the left, which is A."""
        return self.good if self.good_is_left else self.broken

    @property
    def right(self) -> Augmentation:
        """Augmentation on the right, which is B."""
        return self.broken if self.good_is_left else self.good

    @property
    def is_right(self) -> bool:
        """True if the expert chose the right picture."""
        return self.answer == (self.Answer.LEFT if self.good_is_left else self.Answer.RIGHT)


class StudyDraft(CodedModel):
    """The fields of a new study as they were left; opening it makes the Study.

    It names people, contestants, scenarios and jobs and holds none of them: whoever retires or
    removes one is not hindered, and the draft's page says what is gone.
    """

    entered = models.JSONField(
        default=dict, help_text="by field: a text, yes or no, or names; see services.study_drafts"
    )
    revision = models.PositiveIntegerField(
        default=1, help_text="counts what was saved, so that nobody overwrites what they never saw"
    )
    changed_by = account_column(related_name="study_drafts", on_delete=models.SET_NULL)
    made_at = models.DateTimeField(auto_now_add=True)
    changed_at = models.DateTimeField(auto_now=True)

    class Meta:
        ordering = ("-changed_at", "-pk")

    def __str__(self) -> str:
        return self.name or str(self.code)

    @property
    def name(self) -> str:
        """Name of the future study; may be empty."""
        return str(self.entered.get("name", ""))
