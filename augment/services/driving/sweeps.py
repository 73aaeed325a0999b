"""Sweeps and families: one number of a scenario over driven values, ranges drawn into more."""

from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.baselines.rule_placer import FamilyMember, place, sample_family
from augment.errors import AugmentError, Conflict, check_names
from augment.formats import own_json
from augment.formats.writing import Cell
from augment.models import Scenario, Simulation, Sweep, SweepValue
from augment.scene import codec
from augment.scene.entities import Modification, Scene
from augment.scene.numbers import MOST_VALUES, list_numbers, set_number, sweep_values
from augment.services.driving.simulations import Options, load_planner
from augment.services.driving.thresholds import tell_difference
from augment.services.events import log_change
from augment.services.inputs import InputKind, input_field
from augment.services.scenarios.choosing import find_type
from augment.services.scenarios.editing import read_edit
from augment.services.scenarios.scenes import LoadedScenario, add_variant, scenario_seed
from augment.simulation.planners import IDM, OFFSETS_M, PDM_CLOSED

LARGEST_FAMILY = 100
SWEPT = Simulation.Subject.SWEPT
_FURTHEST: dict[str, Any] = {"least": -1e6, "most": 1e6}


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepRequest:
    """A new sweep."""

    number: str = input_field(
        InputKind.TEXT, "Number", "Its path in intent or reference: add[0].speed_mps.", most=200
    )
    low: float = input_field(InputKind.NUMBER, "From", **_FURTHEST)
    high: float = input_field(InputKind.NUMBER, "To", **_FURTHEST)
    count: int = input_field(
        InputKind.WHOLE, "Values, evenly spaced", default=11, least=2, most=MOST_VALUES
    )
    planner: str = input_field(InputKind.TEXT, "Planner under test", default=PDM_CLOSED, most=120)
    offsets: str = input_field(
        InputKind.CHOICE,
        "Lateral offsets of PDM-Closed",
        default="paper",
        choices={"paper": "Up to 4 m (paper)", "original": "Up to 1 m (original)"},
    )
    is_reactive: bool = input_field(
        InputKind.SWITCH, "Recorded vehicles answer to the ego", default=False
    )

    @property
    def values(self) -> tuple[float, ...]:
        """The values, in order; as `sweep_values`."""
        return sweep_values(self.low, self.high, self.count)

    @property
    def options(self) -> Options:
        """Options of its drives; offsets matter to PDM-Closed alone."""
        offsets = self.offsets if self.planner == PDM_CLOSED else Options().offsets
        return Options(planner=self.planner, offsets=offsets, is_reactive=self.is_reactive)


def swept_numbers(scenario: Scenario) -> dict[str, float]:
    """Return every number of a scenario that can be swept, by its path in intent or reference."""
    return list_numbers(_document(scenario, None))


def plan_sweep(
    *,
    scenario: Scenario,
    request: SweepRequest,
    also: Collection[str] = (),
    actor: User | None = None,
) -> Sweep:
    """Have one number of a scenario driven at evenly spaced values.

    Each value is driven by the planner under test, and by those that may solve it: PDM-Closed with
    each of its offsets, and the IDM. A number of the intent is placed by the rule placer, always
    with the same seed; a number of the reference is set there. Call it outside a transaction: no
    lock is held while values are placed, which may take seconds.

    Raises:
        UnknownName: The scenario has no such number, or there is no such planner.
        InvalidDocument: The bounds make no values.
        Conflict: No value fits the scene.
    """
    load_planner(request.options, also=also)
    changes = map_changes(scenario, request)
    how = asdict(request.options)
    del how["version"]
    sweep = Sweep(scenario=scenario, number=request.number, asked_by=actor, **how)
    rows = [
        SweepValue(sweep=sweep, value=value, modification=codec.modification_to_document(change))
        if isinstance(change, Modification)
        else SweepValue(sweep=sweep, value=value, reason=str(change))
        for value, change in changes.items()
    ]
    with transaction.atomic():
        sweep.save()
        SweepValue.objects.bulk_create(rows)
        Simulation.objects.bulk_create(
            Simulation(scenario=scenario, swept=row, subject=SWEPT, **asdict(way))
            for row in rows
            if row.modification is not None
            for way in list_options(request.options)
        )
    return sweep


def map_changes(
    scenario: Scenario, request: SweepRequest
) -> dict[float, Modification | AugmentError]:
    """Return by each value of a number its modification, or why nothing fits.

    Raises:
        UnknownName: The scenario has no such number.
        InvalidDocument: The bounds make no values.
        Conflict: No value fits.
    """
    scene, number = LoadedScenario(scenario).scene, request.number
    check_names("number", [number], swept_numbers(scenario))
    document, changes = _document(scenario, number), dict[float, Modification | AugmentError]()
    for value in request.values:
        try:
            changes[value] = _change(scenario, scene, set_number(document, number, value))
        except AugmentError as refused:
            changes[value] = refused
    refusals = [change for change in changes.values() if isinstance(change, AugmentError)]
    if len(refusals) == len(changes):
        raise Conflict(f"No value of {number} fits: {refusals[0]}")
    return changes


def write_values(scenario: Scenario, request: SweepRequest) -> dict[str, bytes]:
    """Return the values that fit as scenarios in the own JSON, files by name; as `map_changes`."""
    loaded = LoadedScenario(scenario)
    cells = [
        Cell(
            name=f"{scenario.slug} with {request.number} = {value:g}",
            stem=f"{scenario.slug}--{value:.10g}",
            scene=loaded.scene,
            type=find_type(scenario.type),
            modification=change,
            keeps_traffic=scenario.keep_traffic,
            recording=loaded.recording,
        )
        for value, change in map_changes(scenario, request).items()
        if isinstance(change, Modification)
    ]
    return own_json.write(cells).files


@transaction.atomic
def delete_sweep(sweep: Sweep, *, actor: User | None = None) -> None:
    """Delete a sweep with its drives; the scenario that it kept stays."""
    log_change(sweep, "delete", actor, before={"what": str(sweep)})
    sweep.delete()


def list_options(tested: Options) -> list[Options]:
    """Return the ways in which each value is driven, the tested one first."""
    named = [
        Options(planner=IDM, is_reactive=tested.is_reactive),
        *(Options(offsets=name, is_reactive=tested.is_reactive) for name in OFFSETS_M),
    ]
    return list(dict.fromkeys([tested, *named]))


def add_family(
    *, scenario: Scenario, count: int, seed: int, actor: User | None = None
) -> tuple[list[Scenario], list[FamilyMember]]:
    """Add scenarios with numbers drawn from the ranges of one's intent; as `plan_sweep`.

    Returns:
        The scenarios, and the members that fit nowhere.

    Raises:
        CannotPlace: There is no intent, or none of its numbers is a range.
        Conflict: The count or the seed is out of bounds.
    """
    if not 1 <= count <= LARGEST_FAMILY:
        raise Conflict(f"A family has 1 to {LARGEST_FAMILY} members, not {count}.")
    if seed < 0:
        raise Conflict(f"A seed is 0 or more, not {seed}.")
    loaded = LoadedScenario(scenario)
    intent = loaded.intent
    if intent is None:
        raise Conflict(f"“{scenario.slug}” has no intent whose ranges could be drawn from.")
    members = sample_family(loaded.scene, intent, count=count, seed=seed)
    with transaction.atomic():
        rows = [
            add_variant(
                scenario,
                difference=tell_difference(intent, member.intent),
                reference=member.modification,
                intent=member.intent,
                actor=actor,
            )
            for member in members
            if member.modification is not None
        ]
    return rows, [member for member in members if member.modification is None]


# --- Private -----------------------------------------------------------------------------------


def _document(scenario: Scenario, number: str | None) -> dict[str, Any]:
    """Return the intent if it has the number, else the reference; both where none is named."""
    intent, reference = scenario.intent or {}, scenario.reference or {}
    if number is None:
        return {**reference, **intent}
    return intent if number in list_numbers(intent) else reference


def _change(scenario: Scenario, scene: Scene, document: dict[str, Any]) -> Modification:
    if document["format"] == codec.INTENT.frame["format"]:
        intent = codec.intent_from_document(document)
        return place(scene, intent, seed=scenario_seed(scenario.slug)).modification
    return read_edit(scenario, document)
