"""Speeds that an agent of its kind does not have."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import STOPPED_BELOW_MPS, ChangedScene
from augment.checks.size import unusual_words
from augment.scene.entities import AgentType, TrafficAgent

USUAL_MPS: dict[AgentType, float] = {
    AgentType.VEHICLE: 36.0,
    AgentType.BUS: 28.0,
    AgentType.BICYCLE: 12.0,
    AgentType.PEDESTRIAN: 4.0,
}
"""The fastest that still looks normal; what is not listed stands."""
FAR_OFF = 1.7
OVER_LIMIT = 1.5
"""By this factor above the limit of its lane a vehicle is too fast to be normal traffic."""


def speed(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful above what is usual for the type or on its lane, or backwards; wrong far above.

    A thing that can't move and does is wrong.
    """
    for agent in situation.changed:
        usual_mps = USUAL_MPS.get(agent.type, STOPPED_BELOW_MPS)
        limit_mps = _limit_mps(agent, situation)
        off = abs(agent.speed_mps) / usual_mps
        if off > 1.0:
            is_wrong = off > FAR_OFF or agent.type not in USUAL_MPS
            yield _finding(agent, unusual_words(agent.type), is_wrong=is_wrong)
        elif limit_mps is not None and agent.speed_mps > OVER_LIMIT * limit_mps:
            words = f"where the limit is {limit_mps:.1f} m/s."
            yield _finding(agent, words, is_wrong=False)
        elif agent.speed_mps < -STOPPED_BELOW_MPS:
            yield _finding(agent, "backwards.", is_wrong=False)


def _limit_mps(agent: TrafficAgent, situation: ChangedScene) -> float | None:
    under = situation.under(agent)
    if under is None or agent.type not in (AgentType.VEHICLE, AgentType.BUS):
        return None
    return situation.ground.graph.lanes[under.lane_id].speed_limit_mps


def _finding(agent: TrafficAgent, words: str, *, is_wrong: bool) -> Finding:
    return Finding(
        kind=FindingKind.SPEED,
        severity=Severity.WRONG if is_wrong else Severity.DOUBTFUL,
        agents=(agent.id,),
        measured={"speed_mps": agent.speed_mps},
        template=f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s, {words}",
    )
