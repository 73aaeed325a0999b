"""Boxes that are too large or too small for what they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene
from augment.scene.entities import AgentType, TrafficAgent


class Range(NamedTuple):
    """Length and width (m) that real ones have, from the smallest to the largest."""

    length_m: tuple[float, float]
    width_m: tuple[float, float]


USUAL: dict[AgentType, Range] = {
    AgentType.VEHICLE: Range((2.4, 13.0), (1.2, 3.5)),  # from a microcar to a rigid truck
    AgentType.BUS: Range((5.0, 20.0), (1.8, 3.5)),
    AgentType.BICYCLE: Range((1.0, 2.8), (0.3, 1.3)),
    AgentType.PEDESTRIAN: Range((0.3, 1.5), (0.3, 1.5)),
    AgentType.TRAFFIC_CONE: Range((0.15, 1.0), (0.15, 1.0)),
    AgentType.BARRIER: Range((0.2, 6.0), (0.1, 3.0)),
    AgentType.CONSTRUCTION_SIGN: Range((0.1, 4.0), (0.1, 3.0)),
    AgentType.GENERIC_OBJECT: Range((0.1, 8.0), (0.1, 4.0)),
}
FAR_OFF = 1.7
"""By this factor outside its range a size is no longer unusual but wrong."""

_LONG = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE})


def size(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful outside the usual range of the type, wrong far outside or with sides swapped."""
    for agent in situation.changed:
        usual = USUAL[agent.type]
        off = max(_factor(agent.length_m, usual.length_m), _factor(agent.width_m, usual.width_m))
        swapped = agent.type in _LONG and agent.width_m > agent.length_m
        if off > 1.0 or swapped:
            yield _finding(agent, off, swapped=swapped)


def _factor(value_m: float, usual_m: tuple[float, float]) -> float:
    """How many times too small or too large a value is; at most 1 within the range."""
    low, high = usual_m
    return max(low / max(value_m, 1e-3), value_m / high)


def _finding(agent: TrafficAgent, off: float, *, swapped: bool) -> Finding:
    words = unusual_words(agent.type)
    if swapped:
        words = "wider than long: its length and width look swapped."
    return Finding(
        kind=FindingKind.SIZE,
        severity=Severity.WRONG if swapped or off > FAR_OFF else Severity.DOUBTFUL,
        agents=(agent.id,),
        measured={"length_m": agent.length_m, "width_m": agent.width_m},
        template=f"{{agents[0]}} is {{length_m:.2f}} m long and {{width_m:.2f}} m wide, {words}",
    )


def unusual_words(kind: AgentType) -> str:
    """That something is unusual for its type."""
    return f"which is unusual for {name_type(kind)}."


def name_type(kind: AgentType) -> str:
    """One of a type, with its article."""
    return _NAMES[kind]


_NAMES = {
    AgentType.EGO_VEHICLE: "an ego vehicle",
    AgentType.VEHICLE: "a vehicle",
    AgentType.BUS: "a bus",
    AgentType.BICYCLE: "a bicycle",
    AgentType.PEDESTRIAN: "a pedestrian",
    AgentType.TRAFFIC_CONE: "a traffic cone",
    AgentType.BARRIER: "a barrier",
    AgentType.CONSTRUCTION_SIGN: "a construction sign",
    AgentType.GENERIC_OBJECT: "a generic object",
}
