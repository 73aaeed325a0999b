"""What the checks against an intent look at: a modification, and who answers what in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from augment.checks.asked.parties import Party, RequestMatching
from augment.checks.finding import Finding, Severity
from augment.checks.lanes_across import LanesAcross
from augment.checks.tolerances import Tolerances
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Modification, Scene, TrafficAgent, TrafficSide
from augment.scene.intent import Facing


@dataclass(frozen=True, kw_only=True, eq=False)
class Asked:
    """One modification, held against one intent.

    Attributes:
        to_move, to_remove: Ids of the scene's agents that are to be elsewhere, or to go.
        unmet: Why the wish can't be met; None where it can.
    """

    modification: Modification
    lanes: LanesAcross
    matching: RequestMatching
    tolerances: Tolerances
    to_move: frozenset[str] = frozenset()
    to_remove: frozenset[str] = frozenset()
    unmet: str | None = None

    @property
    def route(self) -> EgoRoute:
        """The ego's path over lanes."""
        return self.lanes.route

    @property
    def kerb(self) -> float:
        """On which side the kerb is: 1 left, -1 right."""
        return kerb_of(self.route.scene)

    @property
    def parties(self) -> tuple[Party, ...]:
        """The requests with those who answer them."""
        return self.matching.parties

    def ahead_m(self, agent: TrafficAgent) -> float:
        """How far along the ego's route an agent is."""
        return self.route.locate_agent(agent).ahead_m

    def left_m(self, agent: TrafficAgent) -> float:
        """How far left of the ego's route an agent is."""
        return self.route.locate_agent(agent).left_m


AskedCheck = Callable[[Asked], Iterator[Finding]]


def kerb_of(scene: Scene) -> float:
    """On which side of the ego's lane the kerb is: 1 left, -1 right."""
    return 1.0 if scene.traffic_side is TrafficSide.LEFT else -1.0


def distance_outside(value: float, low: float, high: float) -> float:
    """How far a value is outside a range, 0 within it."""
    return max(low - value, value - high, 0.0)


def severity_of(*, fits: bool) -> Severity:
    """What was asked for in so many words is there, or it is wrong."""
    return Severity.FACT if fits else Severity.WRONG


def facing_words(facing: Facing | None) -> str:
    """Which way something is to face, as its lane leads where nothing is said."""
    return _FACING[facing or Facing.WITH_LANE]


def side_of(left: float) -> str:
    """The side of a number whose left is positive."""
    return "left" if left >= 0.0 else "right"


_FACING = {
    Facing.WITH_LANE: "facing with the lane",
    Facing.AGAINST_LANE: "facing against the lane",
    Facing.ACROSS: "facing across the lane",
}
