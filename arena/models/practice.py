"""Pairs to practise on before a study's first pair: nothing of them is a vote."""

from __future__ import annotations

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from arena.models.studies import Study
from arena.models.tokens import fresh_token
from augment.models import Augmentation, Scenario


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
    expert = models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=models.CASCADE, related_name="practice_pairs"
    )
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

    def __str__(self) -> str:
        return f"{self.position}"

    @property
    def left(self) -> Augmentation:
        """What stands left, which is A."""
        return self.good if self.good_is_left else self.broken

    @property
    def right(self) -> Augmentation:
        """What stands right, which is B."""
        return self.broken if self.good_is_left else self.good

    @property
    def is_right(self) -> bool:
        """Whether the expert chose the right picture."""
        return self.answer == (self.Answer.LEFT if self.good_is_left else self.Answer.RIGHT)
