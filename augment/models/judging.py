"""Questions to language models that judge pairs, and their answers; measures of augmentations."""

from django.db import models
from django.db.models import F, Q

from augment.models.budgets import CappedWork
from augment.models.contestants import Endpoint
from augment.models.jobs import Augmentation
from augment.models.work import Work, account_column


class JudgeRun(CappedWork):
    """One model that is asked about pairs, each in both orders. Never a person's vote."""

    class State(models.TextChoices):
        RUNNING = "running", "Running"
        CANCELLED = "cancelled", "Cancelled"
        FINISHED = "finished", "Finished"
        STOPPED_AT_CAP = "stopped_at_cap", "Stopped at cap"

    endpoint = models.ForeignKey(Endpoint, on_delete=models.PROTECT, related_name="judge_runs")
    model = models.CharField(max_length=120, help_text="the model id on the endpoint")
    question = models.CharField(max_length=20, default="instruction", help_text="what is asked")
    frames = models.PositiveSmallIntegerField(
        default=0, help_text="moments of what moves that are shown beside each picture"
    )
    state = models.CharField(max_length=20, choices=State.choices, default=State.RUNNING)
    asked_by = account_column()

    class Meta:
        ordering = ("-pk",)

    def __str__(self) -> str:
        return f"{self.model} at {self.endpoint.label}"


class PairJudgement(Work):
    """One pair before a judge: its answers with `left` as picture A, and with `right` as A.

    An answer is A, B, equal or unreadable; empty where it was not asked yet.
    """

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        DONE = "done", "Done"
        FAILED = "failed", "Failed"
        CANCELLED = "cancelled", "Cancelled"

    run = models.ForeignKey(JudgeRun, on_delete=models.CASCADE, related_name="judgements")
    left = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="+")
    right = models.ForeignKey(Augmentation, on_delete=models.PROTECT, related_name="+")
    left_image = models.CharField(max_length=120, help_text="name, as experts were shown it")
    right_image = models.CharField(max_length=120, help_text="name, as experts were shown it")
    state = models.CharField(max_length=20, choices=State.choices, default=State.QUEUED)
    first = models.CharField(max_length=10, blank=True, help_text="with the left one as A")
    first_reason = models.TextField(blank=True)
    second = models.CharField(max_length=10, blank=True, help_text="with the right one as A")
    second_reason = models.TextField(blank=True)

    class Meta:
        ordering = ("pk",)
        constraints = (
            models.UniqueConstraint(
                name="one_judgement_per_pair", fields=("run", "left", "right")
            ),
            models.CheckConstraint(name="judgement_is_of_two", condition=~Q(left=F("right"))),
            models.CheckConstraint(
                name="done_judgement_has_both_answers",
                condition=~Q(state="done") | (~Q(first="") & ~Q(second="")),
            ),
        )
        indexes = (models.Index(fields=("state", "sent_at")),)


class StoredMeasure(models.Model):
    """One measure of an augmentation, which holds as long as its key is the same."""

    augmentation = models.ForeignKey(
        Augmentation, on_delete=models.CASCADE, related_name="measures"
    )
    name = models.CharField(max_length=20, help_text="displacement, findings, realism, ...")
    key = models.CharField(max_length=64, help_text="SHA-256 of all that it depends on")
    document = models.JSONField(null=True, help_text="null where there is no such measure")

    class Meta:
        constraints = (
            models.UniqueConstraint(name="one_measure_of_a_name", fields=("augmentation", "name")),
        )
