"""Drives as pages show them: one with its partner before the change, and a part of a grid."""

from __future__ import annotations

from dataclasses import dataclass

from arena.jobs.queries import GridPart, Part, View, grid_part
from augment.models import GenerationJob, Simulation
from augment.services.judging.simulations import Options

DRIVES = View(name="drives", cells=300, columns=10, samples=1, rows=50)
"""How many drives are shown at once: one sample of each contestant."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveCells:
    """A part of a job's grid with its drives by augmentation, and those of its scenes."""

    grid: GridPart
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


def cells_of(job: GenerationJob, options: Options, part: Part) -> DriveCells:
    """The drives of a part of a job's grid; seven queries, no traces."""
    shown = grid_part(job, part)
    scenarios = [row.scenario.pk for row in shown.rows]
    augmentations = [cell.pk for row in shown.rows for cells in row.cells for cell in cells]
    rows = options.of(Simulation.objects.defer("trace"))
    of_scenes = list(rows.filter(augmentation=None, scenario__in=scenarios))
    subject = Simulation.Subject
    return DriveCells(
        grid=shown,
        by_augmentation={
            row.augmentation_id: row
            for row in rows.filter(augmentation__in=augmentations)
            if row.augmentation_id is not None
        },
        before={row.scenario_id: row for row in of_scenes if row.subject == subject.UNMODIFIED},
        reference={row.scenario_id: row for row in of_scenes if row.subject == subject.REFERENCE},
    )
