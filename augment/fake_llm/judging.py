"""What the stand-in says as a reviewer, an engineer or a viewer.

It works the task out by its own rules and compares; as a viewer it checks that there is a whole
picture and says so: it is a stand-in without eyes.
"""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Sequence

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm.requests import ChatRequest
from augment.fake_llm.sight import Task, agent_of, list_of
from augment.geometry.frames import difference
from augment.scene.entities import AgentType, TrafficAgent

_FAR_M = 3.0
_TURNED_RAD = math.radians(20.0)
_VEHICLES = frozenset({AgentType.VEHICLE, AgentType.BUS})

Problem = dict[str, str]


def problems_of(task: Task) -> list[Problem]:
    """What is wrong with the work in the task, by the stand-in's own placement.

    Nothing where it does not know what the wish asks for.
    """
    try:
        right = list(place(task.scene, task.intent).modification.added)
    except CannotPlace:
        return []
    added = list_of(task.prompt, "Added agents").items()
    added_agents = [agent_of(name, vector[:8]) for name, vector in added]
    if len(added_agents) != len(right):
        return [
            _problem(
                f"{len(added_agents)} agents were added, {len(right)} were asked for.", "Count."
            )
        ]
    problems: list[Problem] = []
    for agent in added_agents:
        meant = min(right, key=lambda one: _distance_m(one, agent))
        right.remove(meant)
        problems += _differences(agent, meant)
    return problems


def write_ratings(problems: Sequence[Problem]) -> str:
    """A text reviewer's answer: low ratings with feedback, or high ones."""
    low = {"compliance": 2, "realism": 3, "logical_consistency": 2}
    high = dict.fromkeys(low, 5)
    block = {"ratings": low if problems else high, "feedback": list(problems)}
    feedback = (
        "; ".join(problem["problem"] for problem in problems) or "Nothing is to be corrected."
    )
    return (
        "Summary: A road with the ego on it, and what the user wished for.\n\n"
        "Questions:\n1. Is everything where it was wished for?\n2. Does it face the right way?\n"
        f"3. Is the number right?\n\nAnswers:\n1. to 3. {feedback}\n\nRatings: See below.\n\n"
        f"Review:\n```json\n{json.dumps(block)}\n```\n"
    )


def write_questions(names: Sequence[str]) -> str:
    """An engineer's questions about the agents of those names."""
    about = [f"In which lane does {name} stand?" for name in names[:6]]
    about += ["Do any two blue objects overlap?", "Is a blue object off the road?"]
    about += ["Is the ego alone in its lane?"]
    return f"I ask the viewer.\n```json\n{json.dumps({'questions': about[:8]})}\n```\n"


def write_verdict(problems: Sequence[Problem]) -> str:
    """An engineer's verdict."""
    block = {"verdict": "feedback" if problems else "accept", "feedback": list(problems)}
    return f"I have weighed the answers.\n```json\n{json.dumps(block)}\n```\n"


def describe_picture(request: ChatRequest) -> str:
    """A viewer's answer to each question: what picture it was given, and nothing it can't see."""
    last = request.messages[-1]
    sizes = [image.size_px for message in request.messages for image in message.images]
    count = len(re.findall(r"^[0-9]+\. ", last.text, re.MULTILINE)) or 1
    if not sizes:
        return "There is no picture."
    width, height = sizes[-1]
    lines = [f"1. The picture has {width} x {height} pixels; more I cannot see."]
    return "\n".join(lines + [f"{n}. cannot see" for n in range(2, count + 1)])


def overlook_some(problems: list[Problem], rng: random.Random) -> list[Problem]:
    """What a careless reviewer finds of them: all or, as often, nothing."""
    return problems if rng.random() < 0.5 else []


def _differences(agent: TrafficAgent, meant: TrafficAgent) -> list[Problem]:
    gap_m = _distance_m(agent, meant)
    if agent.type is not meant.type:
        return [_problem(f"{agent.id} is a {agent.type}, not a {meant.type}.", "Use that type.")]
    if gap_m > _FAR_M:
        return [
            _problem(
                f"{agent.id} is {gap_m:.1f} m from where it belongs.",
                f"Move it to ({meant.x_m:.1f}, {meant.y_m:.1f}).",
            )
        ]
    turned = abs(difference(agent.heading_rad, meant.heading_rad))
    if agent.type in _VEHICLES and turned > _TURNED_RAD:
        said = f"{agent.id} is turned by {math.degrees(turned):.0f} degrees."
        return [_problem(said, f"Turn it to {meant.heading_rad:.3f} rad.")]
    return []


def _problem(said: str, action: str) -> Problem:
    reason = "The wish, worked out along the lanes, says otherwise."
    return {"problem": said, "reason": reason, "corrective_action": action}


def _distance_m(one: TrafficAgent, other: TrafficAgent) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)
