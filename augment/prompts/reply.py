"""From a model's answer to a Modification, or an error whose sentences can go back to it.

In: the text of an answer, and the `Scene` that it is about. Out: a `ReadReply` with the
`Modification`, the model's notes and what had to be mended; or `ReplyUnreadable`.

Frame: ego frame of the scene.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Annotated, Literal, TypeVar

from pydantic import Field

from augment.errors import InvalidModification, ReplyUnreadable
from augment.geometry.frames import wrap
from augment.prompts.blocks import last_object
from augment.prompts.names import ShortNames, short_names
from augment.prompts.strict import Strict, validate
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, check_fits

MOST_AGENTS = 64
LONGEST_NOTES = 4000

_KEYS = frozenset({"add", "move", "remove"})
_PLACEABLE = Literal[
    "VEHICLE",
    "BUS",
    "BICYCLE",
    "PEDESTRIAN",
    "TRAFFIC_CONE",
    "BARRIER",
    "CONSTRUCTION_SIGN",
    "GENERIC_OBJECT",
]
_Item = TypeVar("_Item")
_Id = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,31}$")]
_Size = Annotated[float, Field(ge=0.2, le=20.0)]
_Several = Annotated[list[_Item], Field(max_length=MOST_AGENTS)]


class _Agent(Strict):
    id: _Id
    type: _PLACEABLE
    x_m: float
    y_m: float
    heading_rad: float = Field(ge=-2.0 * math.pi, le=2.0 * math.pi)
    width_m: _Size
    length_m: _Size
    speed_mps: float = Field(ge=0.0, le=60.0)
    lane: str | None
    walk_to: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None


class _Block(Strict):
    add: _Several[_Agent] = []
    move: _Several[_Agent] = []
    remove: _Several[_Id] = []


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadReply:
    """An answer that was understood.

    Attributes:
        notes: The answer's own Insights and Summary.
        mended: Whether comments or trailing commas had to be taken out of its JSON.
    """

    modification: Modification
    notes: str
    mended: bool


def read_reply(answer: str, scene: Scene, *, radius_m: float = DEFAULT_RADIUS_M) -> ReadReply:
    """The modification that the answer asks for.

    Args:
        answer: The raw text of the model.
        scene: The scene it was asked about.
        radius_m: No object may lie further than this ahead, behind or to a side.

    Raises:
        ReplyUnreadable: Whatever is wrong with the answer; nothing else is ever raised.
    """
    found, mended = last_object(answer, _KEYS)
    block = validate(_Block, found)
    problems = _misplaced(block, scene, radius_m)
    if problems:
        raise ReplyUnreadable(problems)
    modification = _modification(block, scene)
    return ReadReply(modification=modification, notes=notes_of(answer), mended=mended)


def notes_of(answer: str) -> str:
    """The sections Insights and Summary of an answer, shortened; empty without them."""
    heads = r"Insights|Summary|Modification Dict|Modification Calculations|Modified Vectors"
    parts = re.split(rf"^[ \t#*_]*({heads})[ \t#*_]*:[ \t*_]*", answer, flags=re.MULTILINE)
    bodies = dict(zip(parts[1::2], parts[2::2], strict=True))
    notes = [bodies.get("Insights", "").strip(), bodies.get("Summary", "").strip()]
    return "\n\n".join(part for part in notes if part)[:LONGEST_NOTES]


def _misplaced(block: _Block, scene: Scene, radius_m: float) -> list[str]:
    """What is typed rightly and still can't be: places off the map, lanes nobody knows."""
    names = short_names(scene)
    problems = []
    for agent in [*block.add, *block.move]:
        points = [(agent.x_m, agent.y_m), tuple(agent.walk_to or (0.0, 0.0))]
        if max(abs(value) for point in points for value in point) > radius_m:
            problems.append(f"{agent.id}: x and y must lie between -{radius_m:g} and {radius_m:g}")
        if agent.lane is not None and agent.lane not in names.lane_ids:
            problems.append(f"{agent.id}: its lane is none of the scene's; null means none")
        if agent.walk_to is not None and agent.type != AgentType.PEDESTRIAN:
            problems.append(f"{agent.id}: only a PEDESTRIAN has walk_to")
    return problems[:8]


def _modification(block: _Block, scene: Scene) -> Modification:
    """The change in the scene's own ids; what is wrong with it is told in the short ones."""
    names = short_names(scene)
    shown = replace(scene, agents=tuple(replace(a, id=names.agents[a.id]) for a in scene.agents))
    asked = Modification(
        added=tuple(_agent(agent, names) for agent in block.add),
        moved=tuple(_agent(agent, names) for agent in block.move),
        removed=tuple(block.remove),
    )
    try:
        check_fits(shown, asked)
    except InvalidModification as error:
        raise ReplyUnreadable([str(error)]) from None
    modification = replace(
        asked,
        moved=tuple(replace(a, id=names.agent_ids[a.id]) for a in asked.moved),
        removed=tuple(names.agent_ids[name] for name in asked.removed),
    )
    if {agent.id for agent in asked.added} & names.agents.keys():
        raise ReplyUnreadable(
            [f"an added agent's id is taken: number them from {names.next_agent}"]
        )
    return modification


def _agent(agent: _Agent, names: ShortNames) -> TrafficAgent:
    return TrafficAgent(
        id=agent.id,
        type=AgentType(agent.type),
        x_m=agent.x_m,
        y_m=agent.y_m,
        heading_rad=wrap(agent.heading_rad),
        width_m=agent.width_m,
        length_m=agent.length_m,
        speed_mps=agent.speed_mps,
        lane_id=None if agent.lane is None else names.lane_ids[agent.lane],
        walk_to_m=None if agent.walk_to is None else (agent.walk_to[0], agent.walk_to[1]),
    )
