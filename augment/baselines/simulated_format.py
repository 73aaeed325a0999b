"""Answers that are spoiled on their way: the right block in a form that may be unreadable.

The text goes through the same reader as a language model's.
"""

from __future__ import annotations

import json
import random
import re
from enum import StrEnum

from augment.prompts.names import ShortNames, short_names
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.modification import Modification


class FormatKind(StrEnum):
    """What is wrong with the text of an answer; fences alone are read all the same."""

    FENCES = "fences"
    CUT_OFF = "cut-off"
    NOT_A_NUMBER = "not-a-number"
    ARITHMETIC = "arithmetic"


def spoiled_answer(
    scene: Scene, modification: Modification, kind: FormatKind, rng: random.Random
) -> str:
    """The added agents as the text of an answer with that fault."""
    names = short_names(scene)
    block = json.dumps(
        {"add": [_fields(agent, names) for agent in modification.added], "move": [], "remove": []},
        indent=2,
    )
    match kind:
        case FormatKind.FENCES:
            return f"A first draft:\n```\n{{}}\n```\nAnd the answer:\n```json\n{block}\n```\nDone."
        case FormatKind.CUT_OFF:
            return f"```json\n{block[: rng.randrange(len(block) // 4, len(block) - 12)]}"
        case FormatKind.NOT_A_NUMBER:
            return f"```json\n{_at_first_x(block, 'NaN')}\n```"
        case FormatKind.ARITHMETIC:
            first, second = rng.randint(1, 20), rng.randint(1, 20)
            return f"```json\n{_at_first_x(block, f'{first}.4 + {second}.0')}\n```"


# Private


def _at_first_x(block: str, value: str) -> str:
    return re.sub(r'("x_m": )-?[0-9.]+', rf"\g<1>{value}", block, count=1)


def _fields(agent: TrafficAgent, names: ShortNames) -> dict[str, object]:
    fields: dict[str, object] = {
        "id": agent.id,
        "type": agent.type.value,
        "x_m": round(agent.x_m, 2),
        "y_m": round(agent.y_m, 2),
        "heading_rad": round(agent.heading_rad, 3),
        "width_m": round(agent.width_m, 3),
        "length_m": round(agent.length_m, 3),
        "speed_mps": round(agent.speed_mps, 2),
        "lane": None if agent.lane_id is None else names.lanes.get(agent.lane_id),
    }
    if agent.type is AgentType.PEDESTRIAN and agent.walk_to_m is not None:
        fields["walk_to"] = [round(value, 2) for value in agent.walk_to_m]
    return fields
