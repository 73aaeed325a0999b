"""Files that workers write and pages offer."""

from typing import Any, ClassVar, Self

from django.conf import settings
from django.db import models
from django.db.models import F, Q

from arena.models.studies import Study
from augment.models import Benchmark, GenerationJob, Work


class WrittenFile(Work):
    """One file; of those of the same owner and kind the newest counts.

    Attributes:
        FOLDER: Where the content lies, among the pictures; a backup leaves it out, as it can be
            made again.
        OWN: The columns that say what the file is of; a newer row with the same replaces it.
    """

    FOLDER: ClassVar[str]
    OWN: ClassVar[tuple[str, ...]]

    class State(models.TextChoices):
        QUEUED = "queued", "Waiting"
        RUNNING = "running", "Running"
        READY = "ready", "Ready"
        FAILED = "failed", "Failed"

    state = models.CharField(max_length=10, choices=State.choices, default=State.QUEUED)
    name = models.CharField(max_length=200, blank=True, help_text="what it is called for people")
    stored = models.CharField(max_length=120, blank=True, help_text="its name in the storage")
    size_bytes = models.PositiveBigIntegerField(default=0)
    digest = models.CharField(max_length=64, blank=True, help_text="SHA-256 of the content")
    warnings = models.JSONField(
        default=list, blank=True, help_text="what comes with passing it on"
    )
    is_non_commercial = models.BooleanField(default=False)
    asked_by = models.ForeignKey(
        settings.AUTH_USER_MODEL, null=True, blank=True, on_delete=models.SET_NULL
    )

    class Meta:
        abstract = True

    @property
    def is_waiting(self) -> bool:
        """True while a worker has it or will have it."""
        return self.state in self.UNDER_WAY

    def alike(self) -> models.QuerySet[Self]:
        """The rows of the same owner and kind, this one among them."""
        same: dict[str, Any] = {name: getattr(self, name) for name in self.OWN}
        return type(self)._default_manager.filter(**same)


def state_is_known(name: str) -> models.CheckConstraint:
    """No other state than those above."""
    states = ["queued", "running", "ready", "failed"]
    return models.CheckConstraint(name=name, condition=Q(state__in=states))


def ready_is_stored(name: str) -> models.CheckConstraint:
    """Constraint that a file in state ready has content."""
    return models.CheckConstraint(name=name, condition=~Q(state="ready") | ~Q(stored=""))


class StudyFile(WrittenFile):
    """One file of a study; the newest of a study and kind counts."""

    FOLDER = "study-files"
    OWN = ("study", "kind")

    class Kind(models.TextChoices):
        STUDY = "study", "The whole study"
        RATING = "rating", "Everything of the newest rating"
        INTERPLAN = "interplan", "Scenarios for interPlan"

    study = models.ForeignKey(Study, on_delete=models.CASCADE, related_name="files")
    kind = models.CharField(max_length=20, choices=Kind.choices)

    class Meta:
        ordering = ("study", "kind", "-pk")
        constraints = (
            state_is_known("study_file_state_is_known"),
            ready_is_stored("ready_study_file_is_stored"),
            models.CheckConstraint(
                name="study_file_kind_is_known",
                # Earlier releases wrote contact sheets; their rows stay.
                condition=Q(kind__in=["study", "rating", "interplan", "contact-sheet"]),
            ),
        )
        indexes = (models.Index(F("study"), F("kind"), name="study_file_of_study"),)


class ScenarioFile(WrittenFile):
    """All that a job made, in one format, as one zip; the newest of a job and format counts."""

    FOLDER = "scenario-files"
    OWN = ("job", "format")

    job = models.ForeignKey(GenerationJob, on_delete=models.CASCADE, related_name="files")
    format = models.CharField(max_length=40, help_text="commonroad, scenarionet, ...")

    class Meta:
        ordering = ("job", "format", "-pk")
        constraints = (
            state_is_known("scenario_file_state_is_known"),
            ready_is_stored("ready_scenario_file_is_stored"),
        )
        indexes = (models.Index(F("job"), F("format"), name="scenario_file_of_job"),)


class BenchmarkFile(WrittenFile):
    """The folder of a benchmark as one zip."""

    FOLDER = "benchmark-files"
    OWN = ("benchmark",)

    benchmark = models.ForeignKey(Benchmark, on_delete=models.CASCADE, related_name="files")

    class Meta:
        ordering = ("benchmark", "-pk")
        constraints = (
            state_is_known("benchmark_file_state_is_known"),
            ready_is_stored("ready_benchmark_file_is_stored"),
        )
