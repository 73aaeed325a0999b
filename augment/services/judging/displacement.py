"""The displacement error of stored augmentations, one by one and in groups."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import NamedTuple

from django.db.models import Max, QuerySet

from augment.errors import InvalidDocument, UnknownName
from augment.metrics.displacement import (
    CLASS_OF,
    BoxSummary,
    Displacement,
    Match,
    ObjectClass,
    Summary,
    are_alike,
    displacement,
    summarise,
)
from augment.models import Augmentation, GenerationJob, Scenario
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification, ScenarioType, TrafficAgent
from augment.services.scenarios.scenes import reference_of, type_choices, type_rank
from augment.variants.recipes import SPELLING, spell_variant

__all__ = [
    "PLACED_EXACTLY",
    "BoxSummary",
    "By",
    "Displacement",
    "Group",
    "Match",
    "Measured",
    "Summary",
    "Unmeasured",
    "groups",
    "of_augmentation",
    "of_job",
    "of_latest",
    "of_rows",
    "spell_variant",
    "summarise",
    "types_named",
]

State = Augmentation.State

PLACED_EXACTLY = (ScenarioType.JAYWALKER, ScenarioType.NUDGE, ScenarioType.OVERTAKE)
"""The types of the paper's figure by variant: a crash or a construction zone can lie in many
places that all follow the instruction."""


VARIANTS = tuple(SPELLING.values())
"""How a group of one variant is headed, the paper's first and in its order."""

NO_VARIANT = "Without a variant"

Place = tuple[int, str, str, str]
"""Sorts the groups; rows of the same place are one group."""


class By(StrEnum):
    """What augmentations are grouped by, beside their contestant."""

    TYPE = "type"
    VARIANT = "variant"
    CONTESTANT = "contestant"


class Unmeasured(StrEnum):
    """Why an augmentation has no displacement."""

    UNFINISHED = "waits, runs, failed or was cancelled"
    NO_REFERENCE = "its scenario has no reference that can be read"
    UNREADABLE_ROW = "its stored modification can't be read"


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """One augmentation and how far it is from the reference.

    Attributes:
        displacement: None where there is a reason why not; all missing for an answer that was
            unreadable or refused.
        why_not: The reason, None where it was measured.
    """

    row: Augmentation
    displacement: Displacement | None = None
    why_not: Unmeasured | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """The augmentations of one contestant that belong together.

    Attributes:
        heading: What they have in common: a type, a variant, or the contestant's name.
        contestant: The contestant's name; slug, model and variant as its row has them.
    """

    heading: str
    contestant: str
    slug: str
    model: str
    variant: str
    is_simulated: bool
    summary: Summary


def of_job(job: GenerationJob) -> list[Measured]:
    """Every row of a job; one query."""
    return [*_measured(_rows().filter(job=job))]


def of_latest() -> list[Measured]:
    """The youngest outcome of every contestant on every scenario, over all jobs; one query."""
    settled = Augmentation.objects.filter(state__in=Augmentation.SHOWABLE).order_by()
    youngest = settled.values("scenario", "contestant").annotate(last=Max("pk")).values("last")
    return [*_measured(_rows().filter(pk__in=youngest))]


def of_rows(ids: Collection[int]) -> list[Measured]:
    """The augmentations with these primary keys; one query."""
    return [*_measured(_rows().filter(pk__in=ids))]


def of_augmentation(row: Augmentation) -> Measured:
    """One row whose scenario is loaded; no query."""
    return next(_measured([row]))


def groups(
    measured: Iterable[Measured], *, by: By, types: Collection[str] | None = None
) -> list[Group]:
    """What was measured, summed up: by type in the catalogue's order, else by name.

    Args:
        measured: What has no displacement is left out.
        by: What to group by, beside the contestant.
        types: The scenario types that count; None for the paper's choice: by variant the three
            whose places are definite, else all.
    """
    if types is None and by is By.VARIANT:
        types = PLACED_EXACTLY
    cells: defaultdict[Place, list[tuple[Augmentation, Displacement]]]
    cells = defaultdict(list)
    for one in measured:
        if one.displacement is not None and (types is None or one.row.scenario.type in types):
            cells[_place(one.row, by)].append((one.row, one.displacement))
    return [_group(cells[place], by) for place in sorted(cells)]


def types_named(names: Sequence[str]) -> tuple[str, ...]:
    """Scenario types by their names, or all there are by the word `all`.

    Raises:
        UnknownName: There is no such type.
    """
    known = [name for name, _ in type_choices()]
    if list(names) == ["all"]:
        return tuple(known)
    for name in names:
        if name not in known:
            raise UnknownName("scenario type", name, ["all", *known])
    return tuple(names)


# Private


def _rows() -> QuerySet[Augmentation]:
    return (
        Augmentation.objects.select_related("scenario", "contestant")
        .defer("notes", "scenario__instruction")
        .order_by("scenario__slug", "contestant__slug", "sample")
    )


def _measured(rows: Iterable[Augmentation]) -> Iterator[Measured]:
    references: dict[int, Modification | None] = {}
    for row in rows:
        if row.scenario_id not in references:
            references[row.scenario_id] = _reference(row.scenario)
        yield _one(row, references[row.scenario_id])


def _reference(scenario: Scenario) -> Modification | None:
    try:
        return reference_of(scenario)
    except InvalidDocument:
        return None


def _one(row: Augmentation, reference: Modification | None) -> Measured:
    if row.state not in Augmentation.SHOWABLE:
        return Measured(row=row, why_not=Unmeasured.UNFINISHED)
    if reference is None:
        return Measured(row=row, why_not=Unmeasured.NO_REFERENCE)
    if row.state != State.DONE:
        return Measured(row=row, displacement=displacement(None, reference))
    try:
        generated = modification_from_document(row.modification)
    except InvalidDocument:
        return Measured(row=row, why_not=Unmeasured.UNREADABLE_ROW)
    return Measured(row=row, displacement=displacement(generated, reference))


def _place(row: Augmentation, by: By) -> Place:
    contestant = row.contestant
    who = (contestant.name.lower(), contestant.slug)
    match by:
        case By.TYPE:
            return (type_rank(row.scenario.type), row.scenario.type, *who)
        case By.VARIANT:
            return (_rank(contestant.variant), contestant.variant.lower(), *who)
        case By.CONTESTANT:
            return (0, "", *who)


def _rank(variant: str) -> int:
    """The paper's four in its order, then combinations, then what has no variant."""
    known = list(SPELLING)
    if not variant:
        return len(known) + 1
    return known.index(variant.lower()) if variant.lower() in known else len(known)


def _group(cell: list[tuple[Augmentation, Displacement]], by: By) -> Group:
    row = cell[0][0]
    contestant = row.contestant
    headings = {
        By.TYPE: row.scenario.get_type_display(),
        By.VARIANT: spell_variant(contestant.variant) or NO_VARIANT,
        By.CONTESTANT: contestant.name,
    }
    return Group(
        heading=headings[by],
        contestant=contestant.name,
        slug=contestant.slug,
        model=contestant.model,
        variant=contestant.variant,
        is_simulated=contestant.is_simulated,
        summary=summarise([found for _, found in cell]),
    )


class MatchState(StrEnum):
    """What became of an object."""

    MATCHED = "matched"
    MISSING = "missing"
    SURPLUS = "surplus"


class ObjectPosition(NamedTuple):
    """An object's id and the centre of its box."""

    id: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacedObject:
    """One object of one augmentation, in the ego frame.

    Attributes:
        reference: As the reference places it, None for what is surplus.
        generated: As the contestant places it, None for what is missing.
        distance_m: Between the centres of both, None without the other.
    """

    row: Augmentation
    standing: MatchState
    object_class: ObjectClass
    reference: ObjectPosition | None
    generated: ObjectPosition | None
    distance_m: float | None


def objects_of(job: GenerationJob) -> Iterator[DisplacedObject]:
    """Every object of every measured augmentation, by scenario and contestant.

    In each the matched ones come first, in the order in which they were matched. What has no
    displacement (see `Unmeasured`) has no objects.
    """
    references: dict[int, dict[str, TrafficAgent]] = {}
    for one in of_job(job):
        if one.displacement is None:
            continue
        place = one.row.scenario_id
        if place not in references:
            references[place] = _by_id(reference_of(one.row.scenario))
        yield from _objects(one.row, one.displacement, references[place])


# Private


def _objects(
    row: Augmentation, found: Displacement, wanted: dict[str, TrafficAgent]
) -> Iterator[DisplacedObject]:
    is_done = row.state == Augmentation.State.DONE
    placed = _by_id(modification_from_document(row.modification) if is_done else None)
    pairs = [
        *((match.reference, match.generated, match.distance_m) for match in found.matches),
        *((name, None, None) for name in found.missing),
        *((None, name, None) for name in found.surplus),
    ]
    for reference_id, generated_id, distance_m in pairs:
        reference = None if reference_id is None else wanted[reference_id]
        generated = None if generated_id is None else placed[generated_id]
        agent = reference or generated
        assert agent is not None
        yield DisplacedObject(
            row=row,
            standing=_standing(reference, generated),
            object_class=CLASS_OF[agent.type],
            reference=_spot(reference),
            generated=_spot(generated),
            distance_m=distance_m,
        )


def _standing(reference: TrafficAgent | None, generated: TrafficAgent | None) -> MatchState:
    if generated is None:
        return MatchState.MISSING
    return MatchState.SURPLUS if reference is None else MatchState.MATCHED


def _spot(agent: TrafficAgent | None) -> ObjectPosition | None:
    return None if agent is None else ObjectPosition(id=agent.id, x_m=agent.x_m, y_m=agent.y_m)


def _by_id(change: Modification | None) -> dict[str, TrafficAgent]:
    return {} if change is None else {agent.id: agent for agent in change.changed}


def alike_pairs(cells: Mapping[tuple[str, str], Augmentation]) -> tuple[tuple[str, str, str], ...]:
    """Pairs of contestants whose changes of a scenario are alike.

    Args:
        cells: By scenario (or sample of one) and contestant what is shown. An answer that could
            not be read shows the unchanged scene.

    Returns:
        (scenario, contestant, contestant), sorted; identical pictures are among them.

    Raises:
        InvalidDocument: A stored modification can't be read.
    """
    keys = [row.pk for row in cells.values()]
    kept = Augmentation.objects.filter(pk__in=keys).values_list("pk", "state", "modification")
    read = {pk: _shown(state, document) for pk, state, document in kept.iterator()}
    by_scenario: dict[str, list[tuple[str, Modification | None]]] = {}
    for scenario, contestant in sorted(cells):
        change = read[cells[scenario, contestant].pk]
        by_scenario.setdefault(scenario, []).append((contestant, change))
    return tuple(
        (scenario, first, second)
        for scenario, sides in by_scenario.items()
        for (first, one), (second, other) in combinations(sides, 2)
        if one is not None and other is not None and are_alike(one, other)
    )


def _shown(state: str, document: object) -> Modification | None:
    """The change that the picture shows; None where nothing says what that is."""
    if state != Augmentation.State.DONE:
        return Modification()
    return modification_from_document(document) if document else None
