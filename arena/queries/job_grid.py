"""A part of a job's grid: so many scenarios, contestants and samples as one page can hold."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from django.core.paginator import Page, Paginator
from django.db.models import QuerySet

from augment.models import Augmentation, Contestant, GenerationJob, Scenario

State = Augmentation.State

_LEAN = (*("code", "state", "sample", "image", "scenario_id", "contestant_id"), "job_id")


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """How cells are shown, and how many at once.

    Attributes:
        cells: At most so many on a page, but for a single row.
        columns, samples, rows: At most so many of each.
    """

    name: str
    cells: int
    columns: int
    samples: int
    rows: int


MARKS = View(name="marks", cells=300, columns=10, samples=10, rows=50)
PICTURES = View(name="pictures", cells=24, columns=4, samples=2, rows=12)
VIEWS = {view.name: view for view in (MARKS, PICTURES)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Which part of a grid is asked for; pages count from 1."""

    view: View = MARKS
    row: int = 1
    column: int = 1
    sample: int = 1
    state: str = ""
    search: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PartRow:
    """One scenario, and its samples by contestant."""

    scenario: Scenario
    cells: list[list[Augmentation]]


@dataclass(frozen=True, slots=True, kw_only=True)
class GridPart:
    """What a page shows of a grid."""

    part: Part
    contestants: Page[Contestant]
    samples: Page[int]
    scenarios: Page[Scenario]
    rows: list[PartRow]


def grid_part(job: GenerationJob, part: Part) -> GridPart:
    """Scenarios down, contestants across; five queries, however large the job is.

    Pages beyond the last one are the last one.
    """
    view = part.view
    columns = Paginator(_contestants(job), view.columns).get_page(part.column)
    samples = Paginator(range(1, job.samples + 1), view.samples).get_page(part.sample)
    wide = max(1, len(columns.object_list)) * len(samples.object_list)
    lines = min(view.rows, max(1, view.cells // wide))
    scenarios = Paginator(_scenarios(job, part), lines).get_page(part.row)
    return GridPart(
        part=part,
        contestants=columns,
        samples=samples,
        scenarios=scenarios,
        rows=_rows(job, columns, samples, scenarios),
    )


# --- Private -----------------------------------------------------------------------------------


def _contestants(job: GenerationJob) -> QuerySet[Contestant]:
    found = Contestant.objects.filter(pk__in=job.augmentations.order_by().values("contestant"))
    return found.only("slug", "name", "kind", "code").order_by("name", "pk")


def _scenarios(job: GenerationJob, part: Part) -> QuerySet[Scenario]:
    """Those with a cell of the wanted state, and with the wanted text in their slug."""
    cells = job.augmentations.order_by()
    if part.state:
        cells = cells.filter(state=part.state)
    found = Scenario.objects.filter(pk__in=cells.values("scenario"))
    if part.search:
        found = found.filter(slug__icontains=part.search)
    return found.only("slug", "type", "code").order_by("type", "slug")


def _rows(
    job: GenerationJob, columns: Page[Contestant], samples: Page[int], scenarios: Page[Scenario]
) -> list[PartRow]:
    who, where = list(columns.object_list), list(scenarios.object_list)
    numbers = list(samples.object_list)
    found: defaultdict[tuple[int, int], list[Augmentation]] = defaultdict(list)
    cells = Augmentation.objects.filter(
        job=job, contestant__in=who, scenario__in=where, sample__range=(numbers[0], numbers[-1])
    )
    for cell in cells.only(*_LEAN).order_by("sample"):
        found[cell.scenario_id, cell.contestant_id].append(cell)
    return [
        PartRow(scenario=scenario, cells=[found[scenario.pk, contestant.pk] for contestant in who])
        for scenario in where
    ]
