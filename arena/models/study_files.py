"""Files of a study that take long: all of it, its contact sheet, scenarios for interPlan."""

from __future__ import annotations

from django.db import models
from django.db.models import F, Q

from arena.models.studies import Study
from arena.models.written_files import WrittenFile, ready_is_stored, state_is_known


class StudyFile(WrittenFile):
    """One file of a study; the newest of a study and kind counts."""

    FOLDER = "study-files"
    OWN = ("study", "kind")

    class Kind(models.TextChoices):
        STUDY = "study", "The whole study"
        CONTACT_SHEET = "contact-sheet", "Contact sheet"
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
                condition=Q(kind__in=["study", "contact-sheet", "interplan"]),
            ),
        )
        indexes = (models.Index(F("study"), F("kind"), name="study_file_of_study"),)

    def __str__(self) -> str:
        return f"{self.study}: {self.kind}"
