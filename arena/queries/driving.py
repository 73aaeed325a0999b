"""Drives as pages show them: one with its partner before the change, and a job's all at once."""

from __future__ import annotations

from dataclasses import dataclass

from arena.queries.jobs import JobGrid, grid
from augment.models import GenerationJob, Simulation
from augment.services.judging.simulations import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveCells:
    """The grid of a job with its drives by augmentation, and those of the scenes."""

    grid: JobGrid
    by_augmentation: dict[int, Simulation]
    before: dict[int, Simulation]
    reference: dict[int, Simulation]


def options_of(row: Simulation) -> Options:
    """How it was driven."""
    return Options(planner=row.planner, offsets=row.offsets, is_reactive=row.is_reactive)


def before_of(row: Simulation) -> Simulation | None:
    """The same scene before the change, driven the same way; None until that is done."""
    rows = options_of(row).of(Simulation.objects.filter(scenario_id=row.scenario_id))
    drives = rows.filter(subject=Simulation.Subject.UNMODIFIED, state=Simulation.State.DONE)
    return drives.exclude(pk=row.pk).first()


def cells_of(job: GenerationJob, options: Options) -> DriveCells:
    """Every drive of a job; no documents."""
    rows = options.of(Simulation.objects.defer("document", "trace"))
    of_scenes = list(rows.filter(augmentation=None, scenario__in=job.scenarios.all()))
    subject = Simulation.Subject
    return DriveCells(
        grid=grid(job),
        by_augmentation={
            row.augmentation_id: row
            for row in rows.filter(augmentation__job=job)
            if row.augmentation_id is not None
        },
        before={row.scenario_id: row for row in of_scenes if row.subject == subject.UNMODIFIED},
        reference={row.scenario_id: row for row in of_scenes if row.subject == subject.REFERENCE},
    )
