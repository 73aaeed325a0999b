"""Distance of stored augmentations to their wishes, and displacement from their references."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import Any

from django.db.models import QuerySet

from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.displacement import ALIKE as ALIKE
from augment.metrics.displacement import CLASS_OF, are_alike, displacement, displacement_from_wish
from augment.metrics.displacement import BoxSummary as BoxSummary
from augment.metrics.displacement import Displacement as Displacement
from augment.metrics.displacement import Summary as Summary
from augment.metrics.displacement import summarise as summarise
from augment.metrics.kept import KeptObject, find_kept_objects, summarise_kept
from augment.metrics.kept import KeptSummary as KeptSummary
from augment.models import Augmentation, Contestant, GenerationJob
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification, ScenarioType
from augment.scene.motion import HORIZON_S as HORIZON_S
from augment.services.judging.measures import Measure, read_change, rows_by_scenario
from augment.services.scenarios.scenes import LoadedScenario
from augment.variants.recipes import SPELLING, spell_variant

State = Augmentation.State

PLACED_EXACTLY = (ScenarioType.JAYWALKER, ScenarioType.NUDGE, ScenarioType.OVERTAKE)
"""The types of the paper's figure by variant: a crash or a construction zone can lie in many
places that all follow the instruction."""

VARIANTS = tuple(SPELLING.values())
"""How a group of one variant is headed, the paper's first and in its order."""

NO_VARIANT = "Without a variant"


class By(StrEnum):
    """Grouping of augmentations, beside their contestant."""

    TYPE = "type"
    VARIANT = "variant"
    CONTESTANT = "contestant"


class MissingReason(StrEnum):
    """Why an augmentation has no displacement."""

    UNFINISHED = "waits, runs, failed or was cancelled"
    NO_REFERENCE = "its scenario has no reference that can be read"
    OPEN_WISH = "its scenario names a purpose, which many answers serve"
    UNREADABLE_ROW = "its stored modification can't be read"
    UNFIT_MOTION = "its motion can't be followed in its scene"


@dataclass(frozen=True, kw_only=True)
class Distance:
    """Distance of an augmentation from the reference.

    Attributes:
        displacement: None where there is a reason why not; all missing for an answer that was
            unreadable or refused.
        kept: Of a follow-up what was to stay of the answer before; of all others nothing.
        why_not: The reason, None where it was measured.
    """

    displacement: Displacement | None = None
    kept: tuple[KeptObject, ...] = ()
    why_not: MissingReason | None = None

    @property
    def kept_summary(self) -> KeptSummary | None:
        """Share of what was to stay that did stay, None without any."""
        return summarise_kept(self.kept)


@dataclass(frozen=True, kw_only=True)
class MeasuredRow(Distance):
    """An augmentation with how far it is from the reference.

    Attributes:
        wish: How far it is from what its instruction asks for, None without an intent.
    """

    row: Augmentation
    wish: Displacement | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """The augmentations of one contestant that belong together.

    Attributes:
        heading: What they have in common: a type, a variant, or the contestant's name.
        wish: Of those that have an intent, None without any.
        kept: What follow-ups were to leave alone, None without any.
    """

    heading: str
    contestant: Contestant
    summary: Summary
    kept: KeptSummary | None
    wish: Summary | None = None


def of_job(job: GenerationJob) -> list[MeasuredRow]:
    """Measure every row of a job, or take what is stored."""
    return _measure(_rows().defer("modification").filter(job=job))


def of_rows(ids: Collection[int]) -> list[MeasuredRow]:
    """Measure the augmentations with these primary keys, as those of a job."""
    return _measure(_rows().defer("modification").filter(pk__in=ids))


def groups(measured: Iterable[MeasuredRow], *, by: By) -> list[Group]:
    """Sum up what was measured: by type in the catalogue's order, else by name.

    Args:
        measured: What has no displacement is left out.
        by: What to group by, beside the contestant. By variant only the types count whose places
            are definite, as in the paper.
    """
    cells: defaultdict[tuple[int, str, str, str], list[MeasuredRow]] = defaultdict(list)
    for entry in measured:
        counts = by is not By.VARIANT or entry.row.scenario.type in PLACED_EXACTLY
        if counts and entry.displacement is not None:
            rank, heading = _group_key(entry.row, by)
            contestant = entry.row.contestant
            cells[rank, heading.lower(), contestant.name.lower(), contestant.slug].append(entry)
    return [
        Group(
            heading=_group_key(cell[0].row, by)[1],
            contestant=cell[0].row.contestant,
            summary=summarise(
                [entry.displacement for entry in cell if entry.displacement is not None]
            ),
            kept=summarise_kept([thing for entry in cell for thing in entry.kept]),
            wish=summarise(wishes) if wishes else None,
        )
        for _, cell in sorted(cells.items())
        for wishes in [[measured.wish for measured in cell if measured.wish is not None]]
    ]


def _group_key(row: Augmentation, by: By) -> tuple[int, str]:
    """Return a rank and a heading: variants as the paper has them, combinations, then none."""
    if by is By.TYPE:
        kind, types = row.scenario.type, [*ScenarioType]
        rank = types.index(ScenarioType(kind)) if kind in types else len(types)
        return rank, row.scenario.get_type_display()
    if by is By.CONTESTANT:
        return 0, row.contestant.name
    spellings, variant = list(SPELLING), row.contestant.variant.lower()
    rank = spellings.index(variant) if variant in spellings else len(spellings) + (not variant)
    return rank, spell_variant(row.contestant.variant) or NO_VARIANT


def list_objects(job: GenerationJob) -> Iterator[dict[str, Any]]:
    """Yield every object of every measured augmentation, by scenario and contestant.

    Each is a dict: the `row` that it is of; `object`, whether it is matched, missing or surplus;
    its `class`; where the `reference` and the `generated` one place it, None where only the other
    has it; their `match`, None without one; and `wish_m`, how far the generated one is from what
    is asked for, None without an intent. The matched ones come first, in the order in
    which they were matched. What has no displacement (see `Unmeasured`) has no objects.
    """
    for entry in _measure(_rows().filter(job=job)):
        if entry.displacement is None:
            continue
        wanted, placed = (
            {agent.id: agent for agent in change.changed} if change else {}
            for change in (read_change(entry.row.scenario.reference), _read_answer(entry.row))
        )
        distance = entry.displacement
        wish_m = (
            {match.generated: match.error_m for match in entry.wish.matches} if entry.wish else {}
        )
        for standing, reference_id, generated_id, match in (
            *(("matched", m.reference, m.generated, m) for m in distance.matches),
            *(("missing", name, "", None) for name in distance.missing),
            *(("surplus", "", name, None) for name in distance.surplus),
        ):
            reference, generated = wanted.get(reference_id), placed.get(generated_id)
            yield {
                "row": entry.row,
                "object": standing,
                "class": CLASS_OF[(wanted | placed)[reference_id or generated_id].type],
                "reference": reference,
                "generated": generated,
                "match": match,
                "wish_m": wish_m.get(generated_id),
            }


Cells = Mapping[tuple[str, str], Augmentation]
"""By scenario (or sample of one) and contestant what is shown. An answer that could not be read
shows the unchanged scene."""


def alike_pairs(cells: Cells) -> tuple[tuple[str, str, str], ...]:
    """Return pairs of contestants whose changes of a scenario nobody can tell apart.

    Returns:
        (scenario, contestant, contestant), sorted; identical pictures are among them.

    Raises:
        InvalidDocument: A stored modification can't be read.
    """
    return _choose_pairs(cells, are_alike)


def pairs_apart(cells: Cells, least_m: float) -> tuple[tuple[str, str, str], ...]:
    """Return pairs as `alike_pairs`, of changes that lie so far apart or more before they move."""
    return _choose_pairs(cells, lambda one, other: displacement(one, other).error_m >= least_m)


def _choose_pairs(
    cells: Cells, is_wanted: Callable[[Modification, Modification], bool]
) -> tuple[tuple[str, str, str], ...]:
    rows = Augmentation.objects.filter(pk__in=[row.pk for row in cells.values()])
    shown: dict[int, Modification | None] = {}
    for pk, state, document in rows.values_list("pk", "state", "modification").iterator():
        shown[pk] = None if state == State.DONE else Modification()
        if document:
            shown[pk] = modification_from_document(document)
    by_scenario: defaultdict[str, list[tuple[str, Modification]]] = defaultdict(list)
    for scenario, contestant in sorted(cells):
        change = shown[cells[scenario, contestant].pk]
        if change is not None:
            by_scenario[scenario].append((contestant, change))
    return tuple(
        (scenario, first, second)
        for scenario, sides in by_scenario.items()
        for (first, change), (second, other) in combinations(sides, 2)
        if is_wanted(change, other)
    )


# --- Private -----------------------------------------------------------------------------------


def _rows() -> QuerySet[Augmentation]:
    # Not joined: what many rows share is made once.
    rows = Augmentation.objects.prefetch_related("scenario", "contestant", "follows__scenario")
    return rows.defer("notes").order_by("scenario__slug", "contestant__slug", "sample")


def _measure(rows: Iterable[Augmentation]) -> list[MeasuredRow]:
    listed = list(rows)
    unfinished = Distance(why_not=MissingReason.UNFINISHED)
    ids = [row.pk for row in listed]
    distances, wishes = DISTANCES.of(ids), WISHES.of(ids)
    return [
        MeasuredRow(row=row, wish=wishes.get(row.pk), **vars(distances.get(row.pk, unfinished)))
        for row in listed
    ]


def _compute(ids: Collection[int]) -> dict[int, Distance]:
    loaded: dict[int, LoadedScenario] = {}
    return {
        row.pk: _measure_row(row, loaded.setdefault(row.scenario_id, LoadedScenario(row.scenario)))
        for row in _rows().filter(pk__in=ids)
    }


def _measure_row(row: Augmentation, loaded: LoadedScenario) -> Distance:
    reference, answer, before = read_change(row.scenario.reference), _read_answer(row), row.follows
    if row.scenario.is_open:
        return Distance(why_not=MissingReason.OPEN_WISH)
    if reference is None:
        return Distance(why_not=MissingReason.NO_REFERENCE)
    if answer is None and row.state == State.DONE:
        return Distance(why_not=MissingReason.UNREADABLE_ROW)
    moves = answer is not None and (answer.has_motion or reference.has_motion)
    try:
        distance = displacement(answer, reference, loaded.ground if moves else None)
    except (InvalidDocument, InvalidModification):
        return Distance(why_not=MissingReason.UNFIT_MOTION)
    own = _read_shown(before) if before is not None else None
    earlier = None if before is None else read_change(before.scenario.reference)
    kept_objects: tuple[KeptObject, ...] = ()
    if own is not None and earlier is not None:
        shown = _read_shown(row)
        kept_objects = find_kept_objects(
            own, shown, reference_before=earlier, reference_after=reference
        )
    return Distance(displacement=distance, kept=kept_objects)


def _compute_wishes(ids: Collection[int]) -> dict[int, Displacement]:
    """Measure all rows whose scenario has an intent; a scene is read once."""
    wishes: dict[int, Displacement] = {}
    wished = Augmentation.objects.filter(pk__in=ids, scenario__intent__isnull=False)
    for scenario, rows in rows_by_scenario(wished):
        with suppress(InvalidDocument):
            loaded = LoadedScenario(scenario)
            ground, intent = loaded.ground, loaded.intent
            for row in rows:
                answer = _read_answer(row)
                if intent is None or (answer is None and row.state == State.DONE):
                    continue
                with suppress(InvalidModification):
                    wish = displacement_from_wish(answer, intent, ground)
                    wishes |= {} if wish is None else {row.pk: wish}
    return wishes


DISTANCES = Measure("displacement", Distance, _compute)
WISHES = Measure("wish distance", Displacement, _compute_wishes)


def _read_answer(row: Augmentation) -> Modification | None:
    return read_change(row.modification) if row.state == State.DONE else None


def _read_shown(row: Augmentation) -> Modification | None:
    """Return the change that a row shows: also that before a follow-up that was refused."""
    return read_change(row.modification) if row.is_answer else None
