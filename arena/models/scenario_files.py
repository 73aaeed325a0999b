"""Zips of a job's scenarios, which workers write."""

from __future__ import annotations

from django.db import models
from django.db.models import F

from arena.models.written_files import WrittenFile, ready_is_stored, state_is_known
from augment.models import GenerationJob


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

    def __str__(self) -> str:
        return f"{self.job} as {self.format}"
