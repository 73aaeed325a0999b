"""The displacement of a job object by object: matched, missing or surplus, with both places."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from augment.metrics.displacement import CLASS_OF, Displacement, ObjectClass
from augment.models import Augmentation, GenerationJob
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification, TrafficAgent
from augment.services.judging.displacement import of_job
from augment.services.scenarios.scenes import reference_of


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
