"""Frozen ratings of a study, votes from elsewhere, and who opened results early."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from django.db import models
from django.db.models import F, Q
from django.utils.functional import cached_property

from arena.models.people import fresh_token
from arena.models.studies import Study
from arena.models.votes import Question
from arena.rating.lines import Line
from arena.rating.snapshot_document import Results, read_results, results_document
from augment.models import AppendOnly, Contestant, Work, account_column, user_column

if TYPE_CHECKING:
    _JSONField = models.JSONField[Results, Results]
else:
    _JSONField = models.JSONField


class ResultsField(_JSONField):
    """Results as their document; for migrations it is a JSON field like any other."""

    def deconstruct(self) -> Any:
        name, _, args, kwargs = super().deconstruct()
        return name, "django.db.models.JSONField", args, kwargs | {"default": dict}

    def from_db_value(self, *arguments: Any) -> Any:
        return self.to_python(super().from_db_value(*arguments))

    def to_python(self, value: Any) -> Any:
        return read_results(value) if isinstance(value, dict) else value

    def get_prep_value(self, value: Any) -> Any:
        return results_document(value) if isinstance(value, Results) else value

    def value_to_string(self, obj: models.Model) -> Any:
        return self.get_prep_value(self.value_from_object(obj))


class Snapshot(Work):
    """A frozen rating of a study: which votes, which method, which seed, and what came out.

    Pages and files read what stands here; nothing is computed again. Big ones are computed by a
    worker: they are `queued`, then `running`, and count as a rating only once they are `ready`.
    """

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        READY = "ready", "Ready"
        FAILED = "failed", "Failed"

    created_at = None  # type: ignore[assignment]  # it is called made_at
    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="snapshots")
    state = models.CharField(max_length=10, choices=State.choices, default=State.READY)
    progress = models.PositiveSmallIntegerField(default=100, help_text="percent")
    method = models.CharField(max_length=20, help_text="bt, elo or davidson")
    rounds = models.PositiveIntegerField()
    resampling_unit = models.CharField(max_length=20)
    intervals = models.CharField(
        max_length=20, default="resamples", help_text="closed or resamples"
    )
    covariates = models.JSONField(
        default=list, help_text="what is adjusted for: side, objects, vehicles"
    )
    seed = models.BigIntegerField()
    filters = models.JSONField(
        default=dict, help_text="which votes were asked for: types, experts, kinds and so on"
    )
    last_vote = models.BigIntegerField(
        null=True, blank=True, help_text="no vote after this row counts; null without votes"
    )
    votes_sha256 = models.CharField(max_length=64)
    votes_counted = models.PositiveIntegerField()
    votes_left_out = models.JSONField(default=dict, help_text="how many votes, by reason")
    versions = models.JSONField(default=dict)
    degenerate_rounds = models.PositiveIntegerField(
        default=0, help_text="bootstrap rounds that determined no rating; intervals leave them out"
    )
    results = ResultsField(
        default=Results, help_text="all statistics beside the standings, as the pages show them"
    )
    includes_simulated = models.BooleanField(default=False)
    is_early = models.BooleanField(default=False, help_text="the study was still open")
    made_by = account_column(related_name="snapshots")
    made_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-made_at", "-pk")
        constraints = (
            models.CheckConstraint(
                name="snapshot_state_is_known",
                condition=Q(state__in=["queued", "running", "ready", "failed"]),
            ),
            models.CheckConstraint(
                name="snapshot_progress_is_percent", condition=Q(progress__lte=100)
            ),
        )

    @property
    def question(self) -> str:
        """Question of the rated votes; older ratings know a single question."""
        return str(self.filters.get("question", Question.INSTRUCTION))

    @property
    def marks(self) -> list[str]:
        """Words for captions: whether it is simulated, and whether the study was still open."""
        marks = {"simulated": self.includes_simulated, "early": self.is_early}
        return [word for word, holds in marks.items() if holds]

    @cached_property
    def settled_ties(self) -> int | None:
        """Number of counted ties that were not shown; None if nobody counted them."""
        return self.results.board.settled_ties

    @property
    def votes_cast(self) -> int:
        """Number of counted votes by people; earlier ratings count settled ties with them."""
        return self.votes_counted - (self.settled_ties or 0)


class Standing(models.Model):
    """One line of a snapshot. Null ratings mean that the votes do not determine them.

    Names are kept as they were; without a contestant the votes came from elsewhere. What is called
    as a field of `arena.rating.lines.Line` holds its value.
    """

    snapshot = models.ForeignKey(Snapshot, on_delete=models.CASCADE, related_name="standings")
    contestant = models.ForeignKey(
        Contestant, null=True, blank=True, on_delete=models.PROTECT, related_name="standings"
    )
    slug = models.CharField(max_length=200)
    name = models.CharField(max_length=200)
    variant = models.CharField(max_length=20, blank=True)
    kind = models.CharField(max_length=20, help_text="as the contestant's, or imported")
    is_simulated = models.BooleanField(default=False)
    rank = models.PositiveIntegerField(null=True)
    rank_best = models.PositiveIntegerField(null=True)
    rank_worst = models.PositiveIntegerField(null=True)
    rating = models.FloatField(null=True)
    lower = models.FloatField(null=True)
    upper = models.FloatField(null=True)
    votes = models.PositiveIntegerField()
    wins = models.PositiveIntegerField()
    ties = models.PositiveIntegerField()
    losses = models.PositiveIntegerField()
    note = models.TextField(blank=True)

    class Meta:
        ordering = ("rank", "-rating", "slug")
        constraints = (
            models.UniqueConstraint(name="one_standing_per_slug", fields=("snapshot", "slug")),
            models.CheckConstraint(
                name="standing_counts_add_up",
                condition=Q(votes=F("wins") + F("ties") + F("losses")),
            ),
        )


_COLUMNS = {column.name for column in Standing._meta.local_fields}
STORED = tuple(
    name for column in fields(Line) if (name := column.name) != "name" and name in _COLUMNS
)
"""The fields of a line that a snapshot stores; names in a board are slugs."""


def snapshot_values(line: Line | Standing) -> dict[str, Any]:
    """Return a line's values of the stored fields."""
    return {name: getattr(line, name) for name in STORED}


class SharedRating(models.Model):
    """A link by which anybody reads the table of a rating, until it is taken back.

    Its token is kept as it is, so that the link can be shown again.
    """

    snapshot = models.OneToOneField(Snapshot, on_delete=models.CASCADE, related_name="shared")
    token = models.CharField(max_length=40, unique=True, default=fresh_token)


class EarlyLook(AppendOnly):
    """Somebody opened the results of an open study on purpose; it ends their voting in it."""

    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="early_looks")
    user = user_column("early_looks")
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("at", "pk")
        constraints = (
            models.UniqueConstraint(name="one_early_look_each", fields=("study", "user")),
        )


class VoteFile(models.Model):
    """Votes from elsewhere. Their study is closed and has neither matchups nor pictures."""

    study = models.OneToOneField(Study, on_delete=models.CASCADE, related_name="vote_file")
    name = models.CharField(max_length=200, help_text="of the file")
    sha256 = models.CharField(max_length=64)
    made_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-made_at", "-pk")


class ImportedVote(AppendOnly):
    """One line of a file: `first` against `second` as the file has them."""

    class Outcome(models.TextChoices):
        FIRST = "model_a", "first"
        SECOND = "model_b", "second"
        TIE = "tie", "tie"
        BOTH_BAD = "tie (bothbad)", "both bad"

    file = models.ForeignKey(VoteFile, on_delete=models.CASCADE, related_name="votes")
    line = models.PositiveIntegerField(help_text="of the file, its head is line 1")
    first = models.CharField(max_length=200)
    second = models.CharField(max_length=200)
    outcome = models.CharField(max_length=20, choices=Outcome.choices)
    judge = models.CharField(max_length=200, blank=True)
    item = models.CharField(max_length=200, blank=True)

    class Meta:
        ordering = ("line",)
        constraints = (
            models.UniqueConstraint(name="one_vote_per_line", fields=("file", "line")),
            models.CheckConstraint(
                name="imported_vote_compares_two", condition=~Q(first=F("second"))
            ),
            models.CheckConstraint(
                name="imported_outcome_is_known",
                condition=Q(outcome__in=["model_a", "model_b", "tie", "tie (bothbad)"]),
            ),
        )
