"""What is to be added, moved or removed in a scene, and the scene that results.

Frame: ego frame of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from pydantic import Field

from augment.errors import InvalidModification
from augment.scene.entities import MOST_AGENTS, Agents, AgentType, Scene, TrafficAgent
from augment.scene.schema import CLOSED, Id


@dataclass(frozen=True, slots=True, kw_only=True)
class Modification:
    """A change to a scene; empty means that nothing changes.

    Attributes:
        added: New agents, their ids not in the scene.
        moved: Agents of the scene in their new state, by id.
        removed: Ids of the scene's agents that go.
    """

    __pydantic_config__ = CLOSED

    added: Annotated[Agents, Field(alias="add")] = ()
    moved: Annotated[Agents, Field(alias="move")] = ()
    removed: Annotated[
        tuple[Id, ...], Field(alias="remove", fail_fast=True, max_length=MOST_AGENTS)
    ] = ()

    @property
    def is_empty(self) -> bool:
        """Whether the scene stays as it is."""
        return not (self.added or self.moved or self.removed)

    @property
    def changed(self) -> tuple[TrafficAgent, ...]:
        """Every agent that a picture marks as changed: the added, then the moved."""
        return self.added + self.moved


def apply(scene: Scene, modification: Modification) -> Scene:
    """The scene after the change; the given one stays as it is.

    Raises:
        InvalidModification: An id is unknown, taken, named twice, or the ego's.
    """
    check_fits(scene, modification)
    moved = {agent.id: agent for agent in modification.moved}
    gone = set(modification.removed)
    kept = tuple(moved.get(agent.id, agent) for agent in scene.agents if agent.id not in gone)
    return replace(scene, agents=kept + modification.added)


def check_fits(scene: Scene, modification: Modification) -> None:
    """Raise InvalidModification unless every id of the modification fits the scene."""
    known = {agent.id for agent in scene.agents}
    touched = [agent.id for agent in modification.changed] + list(modification.removed)
    doubled = sorted({name for name in touched if touched.count(name) > 1})
    if doubled:
        raise InvalidModification(f"named more than once: {', '.join(doubled)}")
    for agent in modification.changed:
        if agent.type is AgentType.EGO_VEHICLE:
            raise InvalidModification(f"{agent.id}: an added or moved agent can't be the ego")
    for agent in modification.added:
        if agent.id in known or agent.id == scene.ego.id:
            raise InvalidModification(f"{agent.id} is in the scene already; an added agent is new")
    for name in [agent.id for agent in modification.moved] + list(modification.removed):
        if name == scene.ego.id:
            raise InvalidModification(f"{name} is the ego, which stays where it is")
        if name not in known:
            allowed = ", ".join(sorted(known)) or "none"
            raise InvalidModification(f"{name} is not in the scene; its agents: {allowed}")


def without_traffic(scene: Scene) -> Scene:
    """The scene with the ego alone, as interPlan clears it before its own objects are added."""
    return replace(scene, agents=())
