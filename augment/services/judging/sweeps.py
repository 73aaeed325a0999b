"""Sweeps and families: one number of a scenario over driven values, ranges drawn into more."""

from dataclasses import asdict
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.baselines.family import FamilyMember, sample_family
from augment.baselines.rule_placer import place
from augment.errors import AugmentError, Conflict, UnknownName
from augment.models import Scenario, Simulation, Sweep, SweepValue
from augment.scene import codec
from augment.scene.entities import Modification, Scene
from augment.scene.numbers import list_numbers, set_number, sweep_values
from augment.services.judging.simulations import Options, load_planner
from augment.services.judging.thresholds import tell_difference
from augment.services.scenarios.editing import read_edit
from augment.services.scenarios.scenes import add_variant, intent_of, scene_of, seed_of
from augment.simulation.planners import IDM, OFFSETS_M

LARGEST_FAMILY = 100


def numbers_of(scenario: Scenario) -> dict[str, float]:
    """Return every number of a scenario that can be swept, by its path in intent or reference."""
    return list_numbers(_document(scenario, None))


@transaction.atomic
def plan_sweep(
    *,
    scenario: Scenario,
    number: str,
    low: float,
    high: float,
    count: int,
    options: Options,
    also: tuple[str, ...] = (),
    actor: User | None = None,
) -> tuple[Sweep, list[int]]:
    """Have one number of a scenario driven at evenly spaced values.

    Each value is driven by the planner under test, and by those that may solve it: PDM-Closed with
    each of its offsets, and the IDM. A number of the intent is placed by the rule placer, always
    with the same seed; a number of the reference is set there.

    Returns:
        The sweep, and the keys of its drives, which wait.

    Raises:
        UnknownName: The scenario has no such number, or there is no such planner.
        InvalidDocument: The bounds make no values.
        Conflict: No value fits the scene.
    """
    load_planner(options, also=also)
    values, scene, known = sweep_values(low, high, count), scene_of(scenario), numbers_of(scenario)
    if number not in known:
        raise UnknownName("number", number, list(known))
    document = _document(scenario, number)
    sweep = Sweep.objects.create(
        scenario=scenario, number=number, asked_by=actor, **asdict(options)
    )
    rows = []
    for value in values:
        row = SweepValue(sweep=sweep, value=value)
        try:
            change = _change(scenario, scene, set_number(document, number, value))
            row.modification = codec.modification_to_document(change)
        except AugmentError as refused:
            row.reason = str(refused)
        rows.append(row)
    if all(row.modification is None for row in rows):
        raise Conflict(f"No value of {number} fits: {rows[0].reason}")
    SweepValue.objects.bulk_create(rows)
    drives = Simulation.objects.bulk_create(
        Simulation(scenario=scenario, swept=row, subject=Simulation.Subject.SWEPT, **asdict(way))
        for row in rows
        if row.modification is not None
        for way in ways_of(options)
    )
    return sweep, [drive.pk for drive in drives]


def ways_of(tested: Options) -> list[Options]:
    """Return the ways in which each value is driven, the tested one first."""
    named = [
        Options(planner=IDM, is_reactive=tested.is_reactive),
        *(Options(offsets=name, is_reactive=tested.is_reactive) for name in OFFSETS_M),
    ]
    return list(dict.fromkeys([tested, *named]))


@transaction.atomic
def add_family(
    *, scenario: Scenario, count: int, seed: int, actor: User | None = None
) -> tuple[list[Scenario], list[FamilyMember]]:
    """Add scenarios with numbers drawn from the ranges of one's intent.

    Returns:
        The scenarios, and the members that fit nowhere.

    Raises:
        CannotPlace: There is no intent, or none of its numbers is a range.
        Conflict: The count is out of bounds.
    """
    if not 1 <= count <= LARGEST_FAMILY:
        raise Conflict(f"A family has 1 to {LARGEST_FAMILY} members, not {count}.")
    intent = intent_of(scenario)
    if intent is None:
        raise Conflict(f"“{scenario.slug}” has no intent whose ranges could be drawn from.")
    members = sample_family(scene_of(scenario), intent, count=count, seed=seed)
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
        return place(scene, intent, seed=seed_of(scenario.slug)).modification
    return read_edit(scenario, document)
