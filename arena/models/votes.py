"""Decisions of experts: votes, reports and labels of faults."""

from itertools import combinations

from django.conf import settings
from django.db import models
from django.db.models import F, Q
from django.utils.translation import gettext_lazy as _

from arena.models.people import fresh_token
from arena.models.studies import Matchup
from augment.models import AppendOnly, Augmentation, CodedModel, GenerationJob, user_column

AID_LABELS = {
    "zoom": _("zoom"),
    "original": _("the scene before the edit, kept"),
    "ruler": _("the ruler"),
    "flip": _("the scene before the edit, held"),
    "text": _("the text description"),
    "replay": _("the drives"),
    "blink": _("blinking"),
    "difference": _("the difference"),
    "measures": _("the measures"),
}
"""What an expert may look with; a vote names those that were used, in this order."""
AIDS = tuple(AID_LABELS)

_AID_SETS = [
    " ".join(chosen) for count in range(len(AIDS) + 1) for chosen in combinations(AIDS, count)
]


OUTCOME_LETTERS = {"left": "A", "equal": "E", "right": "B", "skip": "skip"}
"""What an expert presses and the wire says: the left picture is A."""


class Question(models.TextChoices):
    """Question about a pair; a study asks one to three of them, the primary one first."""

    INSTRUCTION = "instruction", _("Which image carries out the instruction better?")
    REALISM = "realism", _("Which image is more realistic?")
    DIFFICULTY = "difficulty", _("Which image is harder for a planner?")


class Vote(AppendOnly):
    """Decision of an expert. Append-only: a change is a new row that supersedes the old one.

    Each question of a study has a vote of its own, given in their order.

    A skip is a decision as well: it says why there is none, and is never rated. It is of the
    primary question, ends the pair, and leaves out what was answered to the others.

    What was shown on which side is copied here, so that the database itself can check that the
    winner was shown.
    """

    class Outcome(models.TextChoices):
        LEFT = "left", "A is better"
        EQUAL = "equal", "Equal"
        RIGHT = "right", "B is better"
        SKIP = "skip", "Skipped"

    class Strength(models.TextChoices):
        SLIGHTLY = "slightly", "slightly"
        CLEARLY = "clearly", "clearly"

    class SkipReason(models.TextChoices):
        CANNOT_JUDGE = "cannot_judge", _("I cannot judge this")
        PICTURE_MISSING = "picture_missing", _("Image does not show")
        UNCLEAR = "unclear", _("Instruction unclear")
        RECOGNISED = "recognised", _("I recognise this scene’s author")
        OTHER = "other", _("Other")

    key = models.UUIDField(unique=True, help_text="made by the browser; the same key is one vote")
    matchup = models.ForeignKey(Matchup, on_delete=models.PROTECT, related_name="votes")
    expert = user_column("votes")
    shown_left = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="+")
    shown_right = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="+")
    question = models.CharField(
        max_length=20, choices=Question.choices, default=Question.INSTRUCTION
    )
    outcome = models.CharField(max_length=10, choices=Outcome.choices)
    both_miss = models.BooleanField(
        default=False, help_text="equal, and both miss the instruction; counts as a tie"
    )
    strength = models.CharField(
        max_length=10,
        blank=True,
        choices=Strength.choices,
        help_text="how clear the preference is, empty where it was not said",
    )
    reason = models.CharField(
        max_length=20, blank=True, choices=SkipReason.choices, help_text="why it was skipped"
    )
    comment = models.TextField(blank=True, max_length=1000)
    aids = models.CharField(
        max_length=80, blank=True, help_text="aids used, in a fixed order, joined by blanks"
    )
    faults = models.JSONField(
        default=list,
        blank=True,
        help_text="what the expert marked as wrong: [side, id of the object, class of fault] each",
    )
    winner = models.ForeignKey(
        Augmentation, null=True, blank=True, on_delete=models.PROTECT, related_name="wins"
    )
    supersedes = models.OneToOneField(
        "self", null=True, blank=True, on_delete=models.PROTECT, related_name="superseded_by"
    )
    is_simulated = models.BooleanField(default=False)
    ms_visible = models.PositiveIntegerField(
        null=True,
        blank=True,
        help_text="how long the pair was on screen until the answer, null if not measured",
    )
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("at", "pk")
        constraints = (
            models.UniqueConstraint(
                name="one_first_vote_per_question",
                fields=("matchup", "question"),
                condition=Q(supersedes=None),
            ),
            models.CheckConstraint(
                name="vote_winner_was_shown",
                condition=Q(outcome="left", winner=F("shown_left"), winner__isnull=False)
                | Q(outcome="right", winner=F("shown_right"), winner__isnull=False)
                | Q(outcome__in=["equal", "skip"], winner=None),
            ),
            models.CheckConstraint(
                name="vote_question_is_known",
                condition=Q(question__in=["instruction", "realism", "difficulty"]),
            ),
            models.CheckConstraint(
                name="vote_both_miss_only_when_equal",
                condition=Q(both_miss=False) | Q(outcome="equal"),
            ),
            models.CheckConstraint(
                name="vote_strength_is_of_a_preference",
                condition=Q(strength="")
                | Q(strength__in=["slightly", "clearly"], outcome__in=["left", "right"]),
            ),
            models.CheckConstraint(
                name="vote_reason_goes_with_skip",
                condition=(~Q(outcome="skip") & Q(reason=""))
                | Q(
                    outcome="skip",
                    reason__in=[
                        "cannot_judge",
                        "picture_missing",
                        "unclear",
                        "recognised",
                        "other",
                    ],
                ),
            ),
            models.CheckConstraint(name="vote_aids_are_known", condition=Q(aids__in=_AID_SETS)),
        )
        indexes = (models.Index(fields=("expert", "at"), name="votes_of_expert_by_time"),)


class Report(AppendOnly):
    """Problem with a matchup that an expert reports, whatever the vote. Append-only."""

    class Reason(models.TextChoices):
        PICTURE_WRONG = "picture_wrong", _("Something is wrong with an image")
        INSTRUCTION_WRONG = "instruction_wrong", _("Something is wrong with the instruction")
        OTHER = "other", _("Other")

    class Side(models.TextChoices):
        LEFT = "left", "A"
        RIGHT = "right", "B"
        BOTH = "both", _("both")

    key = models.UUIDField(unique=True, help_text="made by the browser; one key is one report")
    matchup = models.ForeignKey(Matchup, on_delete=models.PROTECT, related_name="reports")
    expert = user_column("reports")
    reason = models.CharField(max_length=20, choices=Reason.choices)
    side = models.CharField(
        max_length=10,
        blank=True,
        choices=Side.choices,
        help_text="which picture it is about; reports from before this was asked name none",
    )
    mark_x = models.FloatField(
        null=True, blank=True, help_text="from the left, as a share of the picture's width"
    )
    mark_y = models.FloatField(
        null=True, blank=True, help_text="from the top, as a share of the picture's height"
    )
    comment = models.TextField(blank=True, max_length=1000)
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("at", "pk")
        constraints = (
            models.CheckConstraint(
                name="report_reason_is_known",
                condition=Q(reason__in=["picture_wrong", "instruction_wrong", "other"]),
            ),
            models.CheckConstraint(
                name="report_side_is_known", condition=Q(side__in=["", "left", "right", "both"])
            ),
            models.CheckConstraint(
                name="report_mark_lies_in_the_picture",
                condition=Q(mark_x=None, mark_y=None)
                | Q(mark_x__gte=0, mark_x__lte=1, mark_y__gte=0, mark_y__lte=1),
            ),
        )


class LabellingRound(CodedModel):
    """Experts look at the augmentations of one job, each alone, and name their faults."""

    name = models.CharField(max_length=120, unique=True, help_text="experts see it")
    job = models.ForeignKey(GenerationJob, on_delete=models.PROTECT, related_name="labellings")
    experts = models.ManyToManyField(settings.AUTH_USER_MODEL, related_name="labellings")
    seed = models.BigIntegerField()
    opened_at = models.DateTimeField(auto_now_add=True)
    closed_at = models.DateTimeField(null=True, blank=True, help_text="takes no labels since")

    class Meta:
        ordering = ("-opened_at", "-pk")

    def __str__(self) -> str:
        return self.name


class LabelTask(CodedModel):
    """One planned showing of one augmentation to one expert."""

    labelling = models.ForeignKey(LabellingRound, on_delete=models.CASCADE, related_name="tasks")
    expert = user_column("label_tasks")
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


class FaultLabel(AppendOnly):
    """Faults that an expert sees in one augmentation: any of three, or none. Append-only.

    What the checks guessed is kept as it was when the label was saved; null where they could
    not be run.
    """

    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.PROTECT, related_name="fault_labels"
    )
    expert = user_column("fault_labels")
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
