"""Generation jobs as the pages show them: counts, the grid, failures by their reason."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

from django.db.models import Count

from augment.models import Augmentation, Contestant, GenerationJob, Scenario

State = Augmentation.State


@dataclass(frozen=True, slots=True, kw_only=True)
class JobCounts:
    """A job and how many of its augmentations are in each state."""

    job: GenerationJob
    by_state: dict[State, int]

    @property
    def total(self) -> int:
        """Contestants x scenarios."""
        return sum(self.by_state.values())

    @property
    def under_way(self) -> int:
        """What still waits or runs."""
        return sum(self.by_state[state] for state in Augmentation.UNDER_WAY)

    @property
    def is_moving(self) -> bool:
        """Whether anything will change by itself: not where all that is left waits at a cap."""
        if self.job.state == GenerationJob.State.STOPPED_AT_CAP:
            return self.by_state[State.RUNNING] > 0
        return self.under_way > 0

    @property
    def settled(self) -> int:
        """What has its outcome, whichever it is."""
        return self.total - self.under_way

    @property
    def failed(self) -> int:
        """What broke and may be tried again."""
        return self.by_state[State.FAILED]


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


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureGroup:
    """Augmentations without a modification that ended for the same reason."""

    state: State
    reason: str
    augmentations: list[Augmentation]


def list_jobs() -> list[JobCounts]:
    """All jobs, the youngest first; two queries."""
    jobs = list(GenerationJob.objects.select_related("launched_by__person"))
    found: defaultdict[int, Counter[str]] = defaultdict(Counter)
    rows = Augmentation.objects.order_by().values_list("job_id", "state")
    for job_id, state, number in rows.annotate(number=Count("pk")):
        found[job_id][state] = number
    return [_counts(job, found[job.pk]) for job in jobs]


def counts(job: GenerationJob) -> JobCounts:
    """One job; one query."""
    rows = job.augmentations.order_by().values_list("state").annotate(number=Count("pk"))
    return _counts(job, Counter(dict(rows)))


def grid(job: GenerationJob) -> JobGrid:
    """What became of every scenario with every contestant."""
    cells = {(cell.scenario_id, cell.contestant_id): cell for cell in _cells(job)}
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


def failures(job: GenerationJob) -> list[FailureGroup]:
    """What has no modification, grouped by state and reason; machine faults first."""
    groups: defaultdict[tuple[State, str], list[Augmentation]] = defaultdict(list)
    for cell in _cells(job).filter(state__in=[State.FAILED, State.UNREADABLE, State.REFUSED]):
        groups[State(cell.state), cell.reason].append(cell)
    found = [
        FailureGroup(state=state, reason=reason, augmentations=cells)
        for (state, reason), cells in groups.items()
    ]
    return sorted(
        found,
        key=lambda group: (group.state != State.FAILED, -len(group.augmentations), group.reason),
    )


def _cells(job: GenerationJob):  # type: ignore[no-untyped-def]
    documents = ("modification", "scenario__reference")
    return job.augmentations.select_related("scenario", "contestant").defer(*documents)


def _counts(job: GenerationJob, found: Counter[str]) -> JobCounts:
    return JobCounts(job=job, by_state={state: found[state.value] for state in State})
