"""Rows that a worker would pick up: a study's folder has none, and a restore ends them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from django.db import models

from arena.models import Snapshot, Study
from augment.models import (
    Augmentation,
    GenerationJob,
    IntentReading,
    Probe,
    SceneUpload,
    Simulation,
    UploadMoment,
)

_WHY = "It was under way when the backup was taken. Start it again."

UNFINISHED: Mapping[type[models.Model], tuple[str, ...]] = {
    Augmentation: Augmentation.UNDER_WAY,
    GenerationJob: (GenerationJob.State.RUNNING,),
    IntentReading: (IntentReading.State.RUNNING,),
    Probe: Probe.UNDER_WAY,
    SceneUpload: SceneUpload.WAITING,
    Simulation: Simulation.UNDER_WAY,
    Snapshot: (Snapshot.State.QUEUED, Snapshot.State.RUNNING),
    Study: (Study.State.OPEN,),
    UploadMoment: UploadMoment.WAITING,
}
"""The states of each table in which something is still done with a row."""

_ENDED: Mapping[type[models.Model], dict[str, Any]] = {
    # They wait in a job that is paused.
    Augmentation: {"state": "queued", "claim": None, "heartbeat_at": None, "sent_at": None},
    IntentReading: {"state": "failed", "reason": _WHY},
    Probe: {"state": "failed", "reason": _WHY},
    SceneUpload: {"state": "failed", "reason": _WHY, "heartbeat_at": None},
    Simulation: {"state": "failed", "reason": _WHY, "claim": None, "heartbeat_at": None},
    Snapshot: {"state": "failed", "status": _WHY},
    UploadMoment: {"state": "failed", "reason": _WHY, "heartbeat_at": None},
}


def is_unfinished(row: models.Model) -> bool:
    """Return whether something would still be done with a row."""
    return getattr(row, "state", None) in UNFINISHED.get(type(row), ())


def end_restored_work() -> None:
    """Leave nothing for workers to pick up: jobs are paused, all else has failed.

    An admin resumes the jobs and asks for the rest again; studies stay open.
    """
    waiting = Augmentation.objects.filter(state__in=Augmentation.UNDER_WAY)
    jobs = GenerationJob.objects.exclude(state=GenerationJob.State.CANCELLED)
    jobs.filter(pk__in=waiting.values("job")).update(state=GenerationJob.State.PAUSED)
    for model, columns in _ENDED.items():
        rows = model._default_manager.filter(state__in=UNFINISHED[model])
        rows.update(**columns)
