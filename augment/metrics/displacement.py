"""Displacement error: how far what was placed is from what the reference places.

Each added or moved object is matched to one of the reference within its class, so that the sum of
the distances is smallest (the Hungarian algorithm). What is left over is counted, never measured.
Removed agents have no place and take no part. Any frame, the same for both sides.
Notation: R objects of the reference, G generated ones.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from augment.scene.entities import AgentType, Modification, TrafficAgent


class ObjectClass(StrEnum):
    """What can stand for what: a bus for a car, but no cone for a pedestrian."""

    VEHICLE = "vehicle"
    BICYCLE = "bicycle"
    PEDESTRIAN = "pedestrian"
    TRAFFIC_CONE = "traffic cone"
    BARRIER = "barrier"
    CONSTRUCTION_SIGN = "construction sign"
    GENERIC_OBJECT = "generic object"


CLASS_OF = {
    AgentType.EGO_VEHICLE: ObjectClass.VEHICLE,
    AgentType.VEHICLE: ObjectClass.VEHICLE,
    AgentType.BUS: ObjectClass.VEHICLE,
    AgentType.BICYCLE: ObjectClass.BICYCLE,
    AgentType.PEDESTRIAN: ObjectClass.PEDESTRIAN,
    AgentType.TRAFFIC_CONE: ObjectClass.TRAFFIC_CONE,
    AgentType.BARRIER: ObjectClass.BARRIER,
    AgentType.CONSTRUCTION_SIGN: ObjectClass.CONSTRUCTION_SIGN,
    AgentType.GENERIC_OBJECT: ObjectClass.GENERIC_OBJECT,
}

_EVENNESS_PER_M = 1e-6
"""Of matchings with the same sum the one with the smallest squares counts: 1 m and 1 m rather
than 0 m and 2 m. Without it the order of the objects would decide. A distance of d metres weighs
d (1 + 1e-6 d), which changes nothing else."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """A generated object and the one of the reference that it stands for.

    Attributes:
        distance_m: Between the centres.
    """

    reference: str
    generated: str
    object_class: ObjectClass
    distance_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Displacement:
    """One modification against its reference.

    Attributes:
        matches: One for every object that has a counterpart.
        missing: Ids of the reference's objects that nothing stands for.
        surplus: Ids of generated objects that stand for nothing.
    """

    matches: tuple[Match, ...] = ()
    missing: tuple[str, ...] = ()
    surplus: tuple[str, ...] = ()

    @property
    def distances_m(self) -> tuple[float, ...]:
        """The error of every matched object."""
        return tuple(match.distance_m for match in self.matches)

    @property
    def mean_m(self) -> float | None:
        """The mean error, None where nothing is matched."""
        return float(np.mean(self.distances_m)) if self.matches else None


def displacement(generated: Modification | None, reference: Modification) -> Displacement:
    """What a modification places against what the reference places.

    Args:
        generated: None for an answer that was unreadable or refused: all is missing.
        reference: In the same frame.
    """
    placed = () if generated is None else generated.changed
    matches: list[Match] = []
    for object_class in ObjectClass:
        wanted = _of_class(reference.changed, object_class)
        agents = _of_class(placed, object_class)
        matches += _matched(wanted, agents, object_class)
    taken = {match.reference for match in matches}
    used = {match.generated for match in matches}
    return Displacement(
        matches=tuple(matches),
        missing=tuple(agent.id for agent in reference.changed if agent.id not in taken),
        surplus=tuple(agent.id for agent in placed if agent.id not in used),
    )


# Private


def _of_class(agents: Iterable[TrafficAgent], object_class: ObjectClass) -> list[TrafficAgent]:
    return [agent for agent in agents if CLASS_OF[agent.type] is object_class]


def _matched(
    wanted: list[TrafficAgent], found: list[TrafficAgent], object_class: ObjectClass
) -> list[Match]:
    from scipy.optimize import linear_sum_assignment

    if not wanted or not found:
        return []
    apart_m = np.hypot(
        np.subtract.outer([one.x_m for one in wanted], [one.x_m for one in found]),
        np.subtract.outer([one.y_m for one in wanted], [one.y_m for one in found]),
    )  # (R, G)
    rows, columns = linear_sum_assignment(apart_m * (1.0 + _EVENNESS_PER_M * apart_m))
    return [
        Match(
            reference=wanted[row].id,
            generated=found[column].id,
            object_class=object_class,
            distance_m=float(apart_m[row, column]),
        )
        for row, column in zip(rows, columns, strict=True)
    ]
