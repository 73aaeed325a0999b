"""What the checks say about a placement before it is handed in."""

from __future__ import annotations

from dataclasses import dataclass, replace

from augment.checks import Ground, Severity
from augment.checks.against_intent import check_against_intent
from augment.scene.entities import Modification, Scene, TrafficAgent, TurnType
from augment.scene.intent import Intent, Request

_Agents = tuple[TrafficAgent, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementVerdict:
    """What was found about a placement.

    Attributes:
        wrong: The first finding that hardly any instruction can mean, in words.
        doubts: How many findings are a fault unless the instruction asks for it.
    """

    wrong: str | None
    doubts: int

    @property
    def is_clean(self) -> bool:
        """Whether there is nothing but facts."""
        return self.wrong is None and self.doubts == 0


class Jury:
    """The checks on one scene; they see the request and the placement, never a reference."""

    def __init__(self, scene: Scene, route: TurnType = TurnType.STRAIGHT) -> None:
        self._scene = scene
        self._route = route
        self._ground = Ground.of(scene)

    def verdict(self, request: Request, before: _Agents, agents: _Agents) -> PlacementVerdict:
        """What is found about the agents of one request.

        Args:
            request: What they answer.
            before: Agents of earlier requests, which stand already.
            agents: Those that are judged.
        """
        everyone = number_agents((*before, *agents), self._scene)
        names = {agent.id for agent in everyone[len(before) :]}
        after = replace(self._scene, agents=(*self._scene.agents, *everyone[: len(before)]))
        ground = Ground.of(after) if before else self._ground
        own = Modification(added=tuple(agent for agent in everyone if agent.id in names))
        findings = check_against_intent(
            ground, own, Intent(requests=(request,), route=self._route)
        )
        wrong = [one.sentence() for one in findings if one.severity is Severity.WRONG]
        doubts = sum(one.severity is Severity.DOUBTFUL for one in findings)
        return PlacementVerdict(wrong=wrong[0] if wrong else None, doubts=doubts)


def number_agents(agents: _Agents, scene: Scene) -> _Agents:
    """The agents with the ids that follow the highest AgentN of the scene."""
    numbers = [
        int(agent.id.removeprefix("Agent"))
        for agent in scene.everyone
        if agent.id.removeprefix("Agent").isdecimal()
    ]
    first = max(numbers, default=0) + 1
    return tuple(
        replace(agent, id=f"Agent{number}") for number, agent in enumerate(agents, start=first)
    )
