"""What a scenario's instruction says about its reference, number by number.

A claim is written by the scenario's author from the sentence or its paraphrase, not from the
reference, so that they can be held against each other even where no grammar understands them.
Distances run along the ego's lane between centres; left and counter-clockwise are positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from augment.scene.entities import AgentType


class ClaimKind(StrEnum):
    """What is claimed; the unit is in the name."""

    AHEAD = "ahead_m"  # of the agents' middle, from the ego
    LEFT = "left_m"  # of one agent, from the centre of the ego's lane
    SIDE = "side"  # of one agent beside the lane centre: 1 left, -1 right
    CROSSES_FROM = "crosses_from"  # where a walk begins: 1 left, -1 right; it ends opposite
    WALKS_ON = "walks_on_m"  # how much further along the lane a walk ends than it begins
    TURN = "turn_deg"  # of one agent against its lane
    TURNED_APART = "turned_apart_deg"  # of the second agent against the first, either way
    GAP = "gap_m"  # between two agents' centres
    SPACING = "spacing_m"  # between neighbours, in order
    COUNT = "count"  # of all added agents of a type


TOLERANCES: dict[ClaimKind, float] = {
    ClaimKind.AHEAD: 0.5,
    ClaimKind.LEFT: 0.1,
    ClaimKind.SIDE: 0.0,
    ClaimKind.CROSSES_FROM: 0.0,
    ClaimKind.WALKS_ON: 0.5,
    ClaimKind.TURN: 3.0,
    ClaimKind.TURNED_APART: 3.0,
    ClaimKind.GAP: 0.15,
    ClaimKind.SPACING: 0.15,
    ClaimKind.COUNT: 0.0,
}
"""How far a reference may be off what its sentence says, in the kind's own unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One thing that an instruction says.

    Attributes:
        agents: Ids of added agents it is about; none for a count.
        type: What is counted; None for all other kinds.
    """

    kind: ClaimKind
    value: float
    agents: tuple[str, ...] = ()
    type: AgentType | None = None
