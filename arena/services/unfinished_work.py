"""Rows that a worker would pick up: a study's folder has none, and a restore ends them."""

from __future__ import annotations

from collections.abc import Mapping

from django.apps import apps
from django.db import models

from arena.models import Study
from augment.models import FAILED, Augmentation, GenerationJob, Work

_WHY = "It was under way when the backup was taken. Start it again."

_WORK = [model for model in apps.get_models() if issubclass(model, Work)]

UNFINISHED: Mapping[type[models.Model], tuple[str, ...]] = {
    **{model: model.UNDER_WAY for model in _WORK},
    GenerationJob: (GenerationJob.State.RUNNING,),
    Study: (Study.State.OPEN,),
}
"""The states of each table in which something is still done with a row."""


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
    for model in _WORK:
        ended = {"state": FAILED, "reason": _WHY}
        if model is Augmentation:  # it waits in a job that is paused
            ended = {"state": Augmentation.State.QUEUED}
        rows = model._default_manager.filter(state__in=model.UNDER_WAY)
        rows.update(claim=None, heartbeat_at=None, sent_at=None, **ended)
