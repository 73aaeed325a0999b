"""Generation jobs as the pages show them: the grid of scenarios and contestants."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from augment.errors import UnknownName
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services.running.progress import cells_of


@dataclass(frozen=True, slots=True, kw_only=True)
class GridRow:
    """One scenario of the grid.

    Attributes:
        cells: One sample of each contestant, None where nothing was planned.
        samples: All of them.
    """

    scenario: Scenario
    cells: list[Augmentation | None]
    samples: list[list[Augmentation]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class JobGrid:
    """Scenarios down, contestants across."""

    contestants: list[Contestant]
    rows: list[GridRow]


def grid(job: GenerationJob, *, sample: int = 1) -> JobGrid:
    """What became of every scenario with every contestant.

    Raises:
        UnknownName: The job has no such sample.
    """
    if not 1 <= sample <= job.samples:
        known = [str(number) for number in range(1, job.samples + 1)]
        raise UnknownName("sample of this job", str(sample), known)
    found: defaultdict[tuple[int, int], list[Augmentation]] = defaultdict(list)
    for cell in cells_of(job):
        found[cell.scenario_id, cell.contestant_id].append(cell)
    every = [cell for cells in found.values() for cell in cells]
    contestants = sorted({cell.contestant for cell in every}, key=lambda one: one.name)
    scenarios = {cell.scenario_id: cell.scenario for cell in every}
    ordered = sorted(scenarios.values(), key=lambda scenario: (scenario.type, scenario.slug))
    return JobGrid(
        contestants=contestants,
        rows=[
            GridRow(
                scenario=scenario,
                cells=[
                    next((one for one in cells if one.sample == sample), None) for cells in line
                ],
                samples=line,
            )
            for scenario in ordered
            for line in [[found[scenario.pk, who.pk] for who in contestants]]
        ],
    )
