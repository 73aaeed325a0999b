"""Rows of arena: people, studies, matchups, votes, ratings and fault labels."""

from __future__ import annotations

import secrets
import uuid
from typing import Any

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from augment.models import Augmentation, Contestant, GenerationJob, Scenario


def fresh_token() -> str:
    """A token that nobody can guess and that says nothing."""
    return secrets.token_urlsafe(24)


class Person(models.Model):
    """What an account is beside its login: a public code, a pseudonym and preferences."""

    user = models.OneToOneField(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="person"
    )
    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    pseudonym = models.CharField(max_length=60, unique=True)
    preferences = models.JSONField(default=dict, blank=True)
    is_simulated = models.BooleanField(
        default=False, help_text="votes of this account are made by the machine"
    )

    class Meta:
        ordering = ("pseudonym",)
        verbose_name_plural = "people"

    def __str__(self) -> str:
        return self.pseudonym


class Study(models.Model):
    """What experts vote on; its rules are fixed when it opens."""

    class State(models.TextChoices):
        DRAFT = "draft", "Draft"
        OPEN = "open", "Open"
        CLOSED = "closed", "Closed"

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    name = models.CharField(max_length=120, unique=True)
    state = models.CharField(max_length=10, choices=State.choices, default=State.DRAFT)
    contestants = models.ManyToManyField(Contestant, related_name="studies")
    scenarios = models.ManyToManyField(Scenario, related_name="studies")
    experts = models.ManyToManyField(settings.AUTH_USER_MODEL, related_name="studies")
    votes_per_expert = models.PositiveIntegerField()
    seed = models.BigIntegerField()
    rules = models.JSONField(
        default=dict, help_text="the planner's rules, as they were at opening"
    )
    allow_simulated = models.BooleanField(
        default=False, help_text="simulated contestants and votes count; everything then says so"
    )
    opened_at = models.DateTimeField(null=True, blank=True)
    closed_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("-opened_at", "-pk")
        verbose_name_plural = "studies"
        constraints = (
            models.CheckConstraint(
                name="study_state_is_known", condition=Q(state__in=["draft", "open", "closed"])
            ),
        )

    def __str__(self) -> str:
        return self.name


class Matchup(models.Model):
    """One planned showing of two augmentations of one scenario to one expert."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="matchups")
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.PROTECT, related_name="matchups"
    )
    position = models.PositiveIntegerField(help_text="place in the expert's own order, from 1")
    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="matchups")
    left = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="shown_left")
    right = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="shown_right")
    left_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    right_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    draw_probability = models.FloatField(
        help_text="of this pair and scenario, when it was planned"
    )
    served_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        ordering = ("study", "expert", "position")
        constraints = (
            models.UniqueConstraint(
                name="one_matchup_per_position", fields=("study", "expert", "position")
            ),
            models.UniqueConstraint(
                name="one_matchup_per_pair", fields=("study", "expert", "left", "right")
            ),
            models.CheckConstraint(
                name="matchup_shows_two_augmentations", condition=~Q(left=F("right"))
            ),
            models.CheckConstraint(
                name="draw_probability_is_one",
                condition=Q(draw_probability__gt=0, draw_probability__lte=1),
            ),
        )

    def __str__(self) -> str:
        return str(self.code)


class Vote(models.Model):
    """What the expert decided. Append-only: a change is a new row that supersedes the old one.

    What was shown on which side is copied here, so that the database itself can check that the
    winner was shown.
    """

    class Outcome(models.TextChoices):
        LEFT = "left", "A is better"
        EQUAL = "equal", "Equal"
        RIGHT = "right", "B is better"

    key = models.UUIDField(unique=True, help_text="made by the browser; the same key is one vote")
    matchup = models.ForeignKey(Matchup, on_delete=models.PROTECT, related_name="votes")
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.PROTECT, related_name="votes"
    )
    shown_left = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="+")
    shown_right = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="+")
    outcome = models.CharField(max_length=10, choices=Outcome.choices)
    winner = models.ForeignKey(
        Augmentation, null=True, blank=True, on_delete=models.PROTECT, related_name="wins"
    )
    supersedes = models.OneToOneField(
        "self", null=True, blank=True, on_delete=models.PROTECT, related_name="superseded_by"
    )
    is_simulated = models.BooleanField(default=False)
    ms_visible = models.PositiveIntegerField(
        null=True, blank=True, help_text="how long the pair was on screen, null if not measured"
    )
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_first_vote_per_matchup",
                fields=("matchup",),
                condition=Q(supersedes=None),
            ),
            models.CheckConstraint(
                name="vote_winner_was_shown",
                condition=Q(outcome="left", winner=F("shown_left"))
                | Q(outcome="right", winner=F("shown_right"))
                | Q(outcome="equal", winner=None),
            ),
        )

    def __str__(self) -> str:
        return str(self.key)

    def save(self, *args: Any, **kwargs: Any) -> None:
        """Insert the vote.

        Raises:
            TypeError: It is stored already; votes are append-only.
        """
        if not self._state.adding:
            raise TypeError("votes are append-only; a change is a new vote that supersedes")
        super().save(*args, **kwargs)


class Snapshot(models.Model):
    """A frozen rating of a study: which votes, which method, which seed, and what came out."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="snapshots")
    method = models.CharField(max_length=20, help_text="bt or elo")
    rounds = models.PositiveIntegerField()
    resampling_unit = models.CharField(max_length=20)
    seed = models.BigIntegerField()
    votes_sha256 = models.CharField(max_length=64)
    votes_counted = models.PositiveIntegerField()
    votes_left_out = models.JSONField(default=dict, help_text="how many votes, by reason")
    versions = models.JSONField(default=dict)
    status = models.TextField(blank=True, help_text="why there is no rating, if there is none")
    degenerate_rounds = models.PositiveIntegerField(
        default=0, help_text="bootstrap rounds that determined no rating; intervals leave them out"
    )
    includes_simulated = models.BooleanField(default=False)
    is_early = models.BooleanField(default=False, help_text="the study was still open")
    made_by = models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="snapshots",
    )
    made_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-made_at", "-pk")

    def __str__(self) -> str:
        return str(self.code)


class Standing(models.Model):
    """One line of a snapshot. Null ratings mean that the votes do not determine them."""

    snapshot = models.ForeignKey(Snapshot, on_delete=models.CASCADE, related_name="standings")
    contestant = models.ForeignKey(Contestant, on_delete=models.PROTECT, related_name="standings")
    rank = models.PositiveIntegerField(null=True)
    rating = models.FloatField(null=True)
    lower = models.FloatField(null=True)
    upper = models.FloatField(null=True)
    votes = models.PositiveIntegerField()
    wins = models.PositiveIntegerField()
    ties = models.PositiveIntegerField()
    losses = models.PositiveIntegerField()
    note = models.TextField(blank=True)

    class Meta:
        ordering = ("rank", "-rating", "contestant__slug")
        constraints = (
            models.UniqueConstraint(
                name="one_standing_per_contestant", fields=("snapshot", "contestant")
            ),
            models.CheckConstraint(
                name="standing_counts_add_up",
                condition=Q(votes=F("wins") + F("ties") + F("losses")),
            ),
        )

    def __str__(self) -> str:
        return f"{self.rank} {self.contestant_id}"


class LabellingRound(models.Model):
    """Experts look at the augmentations of one job, each alone, and name their faults."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    name = models.CharField(max_length=120, unique=True, help_text="experts see it")
    job = models.ForeignKey(GenerationJob, on_delete=models.PROTECT, related_name="labellings")
    experts = models.ManyToManyField(settings.AUTH_USER_MODEL, related_name="labellings")
    seed = models.BigIntegerField()
    opened_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-opened_at", "-pk")

    def __str__(self) -> str:
        return self.name


class LabelTask(models.Model):
    """One planned showing of one augmentation to one expert."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    labelling = models.ForeignKey(LabellingRound, on_delete=models.CASCADE, related_name="tasks")
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.PROTECT, related_name="label_tasks"
    )
    position = models.PositiveIntegerField(help_text="place in the expert's own order, from 1")
    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.PROTECT, related_name="label_tasks"
    )
    token = models.CharField(max_length=40, unique=True, default=fresh_token)
    original_token = models.CharField(max_length=40, unique=True, default=fresh_token)

    class Meta:
        ordering = ("labelling", "expert", "position")
        constraints = (
            models.UniqueConstraint(
                name="one_label_task_per_position", fields=("labelling", "expert", "position")
            ),
            models.UniqueConstraint(
                name="one_label_task_per_augmentation", fields=("augmentation", "expert")
            ),
            models.CheckConstraint(
                name="label_task_counts_from_one", condition=Q(position__gte=1)
            ),
        )

    def __str__(self) -> str:
        return str(self.code)


class FaultLabel(models.Model):
    """Which faults an expert sees in one augmentation: any of three, or none.

    What the checks guessed is kept as it was when the label was saved; null where they could
    not be run.
    """

    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.PROTECT, related_name="fault_labels"
    )
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.PROTECT, related_name="fault_labels"
    )
    task = models.OneToOneField(LabelTask, on_delete=models.PROTECT, related_name="label")
    position = models.BooleanField()
    heading = models.BooleanField()
    logic = models.BooleanField()
    note = models.TextField(blank=True, max_length=2000)
    guessed_position = models.BooleanField(null=True)
    guessed_heading = models.BooleanField(null=True)
    guessed_logic = models.BooleanField(null=True)
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_fault_label_per_expert", fields=("augmentation", "expert")
            ),
            models.CheckConstraint(
                name="fault_guess_is_whole_or_absent",
                condition=Q(
                    guessed_position__isnull=True,
                    guessed_heading__isnull=True,
                    guessed_logic__isnull=True,
                )
                | Q(
                    guessed_position__isnull=False,
                    guessed_heading__isnull=False,
                    guessed_logic__isnull=False,
                ),
            ),
        )

    def __str__(self) -> str:
        return f"{self.augmentation_id} by {self.expert_id}"
