"""Studies and what they show."""

from typing import Any

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from arena.models.people import fresh_token
from arena.pairing import order
from augment.models import Augmentation, CodedModel, Contestant, JudgeRun, Scenario, user_column


def one_question() -> list[str]:
    """Return the default questions about each pair."""
    return ["instruction"]


class Study(CodedModel):
    """Comparison on which experts vote; its rules are fixed at its opening, after a StudyDraft."""

    class State(models.TextChoices):
        OPEN = "open", "Open"
        CLOSED = "closed", "Closed"
        CANCELLED = "cancelled", "Cancelled"

    name = models.CharField(max_length=120, unique=True)
    state = models.CharField(max_length=10, choices=State.choices, default=State.OPEN)
    contestants = models.ManyToManyField(Contestant, related_name="studies")
    scenarios = models.ManyToManyField(Scenario, related_name="studies")
    experts = models.ManyToManyField(settings.AUTH_USER_MODEL, related_name="studies")
    judges = models.ManyToManyField(
        JudgeRun, related_name="studies", help_text="models that compare its pairs; never voters"
    )
    votes_per_expert = models.PositiveIntegerField()
    seed = models.BigIntegerField()
    questions = models.JSONField(
        default=one_question,
        help_text="what is asked about each pair: one to three keys of Question in their order, "
        "the primary one first",
    )
    allow_both_miss = models.BooleanField(
        default=False, help_text="experts may add to Equal that both miss the instruction"
    )
    ask_strength = models.BooleanField(
        default=False, help_text="experts say whether a preference is slight or clear"
    )
    ask_why = models.BooleanField(
        default=False, help_text="experts may mark which object is wrong, and in what"
    )
    allow_replay = models.BooleanField(
        default=False,
        help_text="experts may play drives under the pictures; `rules` says of which scenarios",
    )
    practice = models.BooleanField(
        default=False, help_text="experts practise on up to five pairs before their first one"
    )
    rules = models.JSONField(
        default=dict, help_text="the planner's rules, as they were at opening"
    )
    allow_simulated = models.BooleanField(
        default=False, help_text="simulated contestants and votes count; everything then says so"
    )
    preregistration = models.TextField(
        blank=True, help_text="the file that was frozen at the opening, as it is downloaded"
    )
    opened_at = models.DateTimeField(null=True, blank=True)
    closed_at = models.DateTimeField(
        null=True, blank=True, help_text="when it took its last votes: closed or cancelled"
    )

    class Meta:
        ordering = ("-opened_at", "-pk")
        verbose_name_plural = "studies"
        constraints = (
            models.CheckConstraint(
                name="study_state_is_known", condition=Q(state__in=["open", "closed", "cancelled"])
            ),
        )

    def __str__(self) -> str:
        return self.name

    @property
    def shows_all_samples(self) -> bool:
        """True if each sample of a scenario is judged on its own."""
        return bool(self.rules.get("samples") == "all")


class Matchup(CodedModel):
    """One planned showing of two augmentations of one scenario to one expert.

    Camera and pictures are kept as they were when it was planned: a scenario that is edited later
    does not change what was judged.
    """

    class Kind(models.TextChoices):
        MAIN = order.MAIN, "Main"
        REPEAT = order.REPEAT, "Hidden repeat"
        CHECK = order.CHECK, "Attention check"

    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="matchups")
    expert = user_column("matchups")
    position = models.PositiveIntegerField(help_text="place in the expert's own order, from 1")
    scenario = models.ForeignKey(Scenario, on_delete=models.PROTECT, related_name="matchups")
    left = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="shown_left")
    right = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="shown_right")
    left_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    right_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    original_token = models.CharField(max_length=40, unique=True, default=fresh_token)
    original_image = models.CharField(
        max_length=120, blank=True, help_text="name of the picture before any change"
    )
    left_image = models.CharField(max_length=120, blank=True, help_text="name, as it was shown")
    right_image = models.CharField(max_length=120, blank=True, help_text="name, as it was shown")
    view = models.JSONField(
        null=True, help_text="where metres lie in its pictures: px_per_m, ego_px, width, height"
    )
    kind = models.CharField(max_length=10, choices=Kind.choices, default=Kind.MAIN)
    repeat_of = models.OneToOneField(
        "self",
        null=True,
        blank=True,
        on_delete=models.CASCADE,
        related_name="repeated_by",
        help_text="the main matchup that this one shows again, sides swapped",
    )
    asked = ""
    """The question that comes next, where a query of the voting page has looked it up."""
    objects_shown: list[list[Any]] | None = None
    """Of either side, left first, the changed objects that can be marked, where a query of the
    voting page has looked them up: id, x, y and radius in pixels of the picture each."""

    batch = models.PositiveIntegerField(
        default=0, help_text="0 was planned at the opening; later plannings count up"
    )

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
                name="matchup_repeats_only_as_repeat",
                condition=Q(kind="repeat", repeat_of__isnull=False)
                | Q(kind__in=["main", "check"], repeat_of=None),
            ),
        )
