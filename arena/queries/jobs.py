"""Generation jobs as the pages show them: the grid of scenarios and contestants."""

from __future__ import annotations

from dataclasses import dataclass

from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services.running.summary import cells_of


@dataclass(frozen=True, slots=True, kw_only=True)
class GridRow:
    """One scenario of the grid; a cell is None where nothing was planned."""

    scenario: Scenario
    cells: list[Augmentation | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class JobGrid:
    """Scenarios down, contestants across."""

    contestants: list[Contestant]
    rows: list[GridRow]


def grid(job: GenerationJob) -> JobGrid:
    """What became of every scenario with every contestant."""
    cells = {(cell.scenario_id, cell.contestant_id): cell for cell in cells_of(job)}
    contestants = sorted(
        {cell.contestant for cell in cells.values()}, key=lambda contestant: contestant.name
    )
    scenarios = {cell.scenario_id: cell.scenario for cell in cells.values()}
    ordered = sorted(scenarios.values(), key=lambda scenario: (scenario.type, scenario.slug))
    return JobGrid(
        contestants=contestants,
        rows=[
            GridRow(
                scenario=scenario,
                cells=[cells.get((scenario.pk, contestant.pk)) for contestant in contestants],
            )
            for scenario in ordered
        ],
    )
