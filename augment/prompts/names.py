"""The short ids that a prompt uses, whatever the ids of the scene look like.

Scenes come from files of other people: a name out of such a file could carry a sentence, so
nothing but our own words and numbers reaches a prompt.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from string import ascii_letters

from augment.scene.entities import Scene


@dataclass(frozen=True)
class ShortNames:
    """Ids of a scene and their short forms, such as Agent2, Lane3, Connector1, Area4.

    Attributes:
        agents, lanes, areas: Short form by the scene's own id; lanes are lanes and connectors.
    """

    agents: dict[str, str]
    lanes: dict[str, str]
    areas: dict[str, str]

    @cached_property
    def agent_ids(self) -> dict[str, str]:
        """The scene's agent id by short form."""
        return {short: name for name, short in self.agents.items()}

    @cached_property
    def lane_ids(self) -> dict[str, str]:
        """The scene's lane or connector id by short form."""
        return {short: name for name, short in self.lanes.items()}

    @property
    def next_agent(self) -> str:
        """The id that the first new agent should get."""
        return f"Agent{1 + max(number_of(short) for short in self.agents.values())}"


def short_names(scene: Scene) -> ShortNames:
    """The short forms for everything in the scene; ids that are short already stay."""
    lanes = _shorten((lane.id for lane in scene.lanes), "Lane")
    connectors = _shorten((connector.id for connector in scene.connectors), "Connector")
    return ShortNames(
        agents=_shorten((agent.id for agent in scene.everyone), "Agent"),
        lanes=lanes | connectors,
        areas=_shorten((area.id for area in scene.areas), "Area"),
    )


def number_of(short: str) -> int:
    """The number at the end of a short id."""
    return int(short.lstrip(ascii_letters))


def _shorten(ids: Iterable[str], prefix: str) -> dict[str, str]:
    names = list(ids)
    kept = {name for name in names if re.fullmatch(prefix + "[1-9][0-9]{0,4}", name, re.ASCII)}
    free = (f"{prefix}{number}" for number in count(1))
    fresh = (name for name in free if name not in kept)
    return {name: name if name in kept else next(fresh) for name in names}
