"""Objects that a follow-up was to leave alone, and their distance from the answer before.

An object is to be kept if both references have it alike, and if the answer before had placed it.
Any frame, the same for all four changes.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from augment.metrics.displacement import displacement, look_alike
from augment.scene.entities import Modification


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptObject:
    """An object of the answer before that was to stay.

    Attributes:
        id: In the answer before.
        distance_m: Between its places in both answers, None where the later one has none for it.
        is_kept: Whether it looks the same in both.
    """

    id: str
    distance_m: float | None
    is_kept: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptSummary:
    """Summary of the objects that follow-ups were to keep.

    Attributes:
        to_keep: Objects that were to stay.
        kept: Of these, those that look the same after the follow-up.
        moved_mean_m: The mean distance of those that are still there, None where none is.
    """

    to_keep: int
    kept: int
    moved_mean_m: float | None


def find_kept_objects(
    before: Modification,
    after: Modification | None,
    *,
    reference_before: Modification,
    reference_after: Modification,
) -> tuple[KeptObject, ...]:
    """Return the objects of an answer that were to stay, and whether the next one kept them.

    Args:
        before: The answer that the follow-up goes on from.
        after: The answer to the follow-up, None where it is none: nothing was kept.
        reference_before: Of the scenario that is followed.
        reference_after: Of the follow-up.
    """
    # What both references have alike is what the follow-up says nothing of.
    alike = {
        agent.id
        for agent in reference_before.changed
        if any(look_alike(agent, other) for other in reference_after.changed)
    }
    matches = displacement(before, reference_before).matches
    to_keep = {match.generated for match in matches if match.reference in alike}
    # The answer before takes the reference's part: each object's own way from one to the next.
    steps = {step.reference: step for step in displacement(after, before).matches}
    old = {agent.id: agent for agent in before.changed}
    new = {agent.id: agent for agent in after.changed} if after else {}
    objects = []
    for name in (agent.id for agent in before.changed if agent.id in to_keep):
        step = steps.get(name)
        objects.append(
            KeptObject(
                id=name,
                distance_m=None if step is None else step.distance_m,
                is_kept=step is not None and look_alike(old[name], new[step.generated]),
            )
        )
    return tuple(objects)


def summarise_kept(objects: Collection[KeptObject]) -> KeptSummary | None:
    """Return their summary, None without any."""
    distances_m = [thing.distance_m for thing in objects if thing.distance_m is not None]
    if not objects:
        return None
    return KeptSummary(
        to_keep=len(objects),
        kept=sum(thing.is_kept for thing in objects),
        moved_mean_m=float(np.mean(distances_m)) if distances_m else None,
    )
