"""Result of a sweep: drives of each value, the planner's threshold, the hardest value solved.

Once the last drive has an outcome the sweep is concluded: whichever worker finds that first keeps
the hardest value as a scenario, and a worker's regular round does where that one died before.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from django.conf import settings
from django.db import transaction
from django.utils import timezone

from augment.baselines.rule_placer import place
from augment.errors import AugmentError
from augment.models import Scenario, Simulation, Sweep, SweepValue
from augment.scene import codec
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from augment.scene.intent_statements import list_statements
from augment.scene.numbers import list_numbers, set_number
from augment.services.scenarios.scenes import LoadedScenario, add_variant, scenario_seed
from augment.simulation.planners import NAMED
from augment.simulation.score import ScoreKind
from augment.simulation.threshold import Trial, TriedValue, find_edges, find_hardest, is_lawful

State = Simulation.State
_TRIAL = ("swept", "planner", "offsets", "state", "nuplan_score", "document", "code", "reason")


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepLine(TriedValue):
    """A value of a sweep.

    Attributes:
        row: With the reason why nothing fits, if that is so.
        drives: Without their traces; the planner under test first.
    """

    row: SweepValue
    drives: tuple[Simulation, ...]

    @property
    def cells(self) -> Sequence[tuple[Simulation | None, bool | None]]:
        """The drives, each with whether it was lawful; None where it has no score."""
        lawful = {trial.driver: trial.is_lawful for trial in self.trials}
        return [(drive, lawful.get(driver_name(drive))) for drive in self.drives]


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepResult:
    """A sweep as far as it has been driven.

    Attributes:
        lines: By value.
        edges: Between which neighbours the outcome changes: (passed, failed).
        hardest: The hardest value that is solved while the planner under test fails.
        planned: How many drives there are.
        under_way: How many of them wait or run.
    """

    sweep: Sweep
    lines: tuple[SweepLine, ...]
    edges: tuple[tuple[float, float], ...]
    hardest: SweepLine | None
    planned: int
    under_way: int

    @property
    def drivers(self) -> list[str]:
        """Drivers of each value, the planner under test first."""
        return list(
            dict.fromkeys(driver_name(drive) for line in self.lines for drive in line.drives)
        )

    @property
    def verdict(self) -> str:
        """Threshold of the planner under test, and what keeps it from driving on, in sentences."""
        passed, planner = {line.is_passed for line in self.lines} - {None}, self.sweep.planner
        is_kept = bool(self.under_way) and planner not in list_allowed_planners()
        note = f" Workers drive {planner} only if ARENA_PLANNERS names it." * is_kept
        if self.edges:
            places = "; ".join(f"it passes {good:g} and fails {bad:g}" for good, bad in self.edges)
            return f"Where the planner fails: {places}.{note}"
        if not passed:
            return f"The planner has driven no value to its end.{note}"
        return f"The planner {'passes' if True in passed else 'fails'} every value driven.{note}"


def list_allowed_planners() -> tuple[str, ...]:
    """Return the planners that workers of this installation may load."""
    return (*NAMED, *settings.PLANNERS)


def sweep_result(sweep: Sweep) -> SweepResult:
    """Return the result of a sweep so far; two queries."""
    drives: dict[int, list[Simulation]] = {}
    for drive in Simulation.objects.filter(swept__sweep=sweep).only(*_TRIAL).order_by("pk"):
        drives.setdefault(drive.swept_id or 0, []).append(drive)
    lines = tuple(_line(sweep, row, drives.get(row.pk, [])) for row in sweep.values.all())
    states = [drive.state for line in lines for drive in line.drives]
    return SweepResult(
        sweep=sweep,
        lines=lines,
        edges=find_edges(lines),
        hardest=find_hardest(lines),
        planned=len(states),
        under_way=sum(state in Simulation.UNDER_WAY for state in states),
    )


def driver_name(drive: Simulation | Sweep) -> str:
    """Return a planner with its offsets, where they matter, as pages and files name it."""
    return f"{drive.planner}, {drive.offsets}" if drive.planner == "pdm-closed" else drive.planner


@transaction.atomic
def conclude(sweep_pk: int) -> None:
    """Keep the hardest value of a sweep whose drives all have outcomes; once."""
    if Simulation.objects.filter(swept__sweep=sweep_pk, state__in=Simulation.UNDER_WAY).exists():
        return
    rows = Sweep.objects.select_for_update(of=("self",), no_key=True)
    sweep = rows.filter(pk=sweep_pk, concluded_at=None).first()
    if sweep is None:
        return
    result = sweep_result(sweep)
    if result.hardest is not None:
        sweep.hardest = _keep(sweep, result.hardest.row)
    sweep.concluded_at = timezone.now()
    sweep.save(update_fields=["hardest", "concluded_at"])


def conclude_all() -> None:
    """Conclude every sweep that is driven and not concluded, for a worker may die in between."""
    driving = Simulation.objects.filter(swept__isnull=False, state__in=Simulation.UNDER_WAY)
    over = Sweep.objects.filter(concluded_at=None).exclude(pk__in=driving.values("swept__sweep"))
    for pk in over.values_list("pk", flat=True):
        conclude(pk)


def tell_difference(before: Intent, after: Intent) -> str:
    """Return the statements of an intent that another one lacks."""
    statements = list_statements(before)
    return "; ".join(
        statement for statement in list_statements(after) if statement not in statements
    )


# --- Private -----------------------------------------------------------------------------------


def _line(sweep: Sweep, row: SweepValue, drives: list[Simulation]) -> SweepLine:
    trials = tuple(
        Trial(
            driver=driver_name(drive),
            score=drive.nuplan_score or 0.0,
            is_lawful=is_lawful(
                {
                    metric["name"]: metric["value"]
                    for metric in drive.document["metrics"][ScoreKind.NUPLAN]
                }
            ),
            is_tested=(drive.planner, drive.offsets) == (sweep.planner, sweep.offsets),
        )
        for drive in drives
        if drive.state == State.DONE and drive.document is not None
    )
    return SweepLine(value=row.value, trials=trials, row=row, drives=tuple(drives))


def _keep(sweep: Sweep, row: SweepValue) -> Scenario:
    """Return the value as a scenario, with its intent where the number is one of the intent."""
    scenario = sweep.scenario
    difference = f"{sweep.number}: {row.value:g}"
    reference = codec.modification_from_document(row.modification)
    intent = _intent_with(sweep, row.value, reference)
    if intent is not None:
        before = codec.intent_from_document(scenario.intent)
        difference = tell_difference(before, intent) or difference
    return add_variant(
        scenario, difference=difference, reference=reference, intent=intent, actor=sweep.asked_by
    )


def _intent_with(sweep: Sweep, value: float, reference: Modification) -> Intent | None:
    """Return the intent with a value that asks for the reference; None without such an intent."""
    scenario = sweep.scenario
    if scenario.intent is None or sweep.number not in list_numbers(scenario.intent):
        return None
    changed = set_number(scenario.intent, sweep.number, value)
    # Somebody may have given the scenario another intent since.
    try:
        intent = codec.intent_from_document(changed)
        scene = LoadedScenario(scenario).scene
        made = place(scene, intent, seed=scenario_seed(scenario.slug)).modification
    except AugmentError:
        return None
    stored = codec.modification_to_document(made)
    return intent if codec.modification_from_document(stored) == reference else None
