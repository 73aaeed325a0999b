"""The stand-in's characters: each plays every role, in its own manner.

It works the task out by its own rules. As a reviewer it compares with that; as a viewer it checks
that there is a picture and says so: it is a stand-in without eyes.
Frame: ego frame.
"""

import json
import math
import re
import struct
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm import careless, sight
from augment.fake_llm.wire import Calls, ChatRequest
from augment.geometry.frames import difference, wrap
from augment.prompts.calls import TOOL
from augment.scene.codec import intent_to_parts
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.intent import Intent
from augment.scene.lane_graph import LaneGraph
from augment.variants.respondents import ModelRole

SEES_NOTHING = "I can't find a scene and an instruction in what I was given."
UNKNOWN = "I am a stand-in and read no English; this sentence is not on my list of intents."

_MOST_CALLS = 8
_FAR_M = 3.0
_TURNED_RAD = math.radians(20.0)
_VEHICLES = frozenset({AgentType.VEHICLE, AgentType.BUS})
_RATINGS = ("compliance", "realism", "logical_consistency")

Problem = dict[str, str]
_Bend = Callable[[sight.Task, Modification, sight.Heard], Modification]
Answer = tuple[str, Calls]
"""A text, native calls of functions, or both."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Character:
    """A manner of playing every role.

    Attributes:
        hear: What it takes the wish to be, given the task and what was heard.
        bend: What becomes of a right modification, given the task and what was heard.
        spoil: What becomes of a modifier's finished answer.
        judge: What a reviewer finds.
        never_stops: Whether it calls as long as it may, and longer.
    """

    hear: Callable[[sight.Task, sight.Heard], Intent | None] = lambda task, _: task.intent
    bend: _Bend = lambda task, right, _: right
    spoil: Callable[[sight.Task, str, sight.Heard], str] = lambda task, text, _: text
    judge: Callable[[sight.Task], list[Problem]] = lambda task: problems_of(task)
    never_stops: bool = False

    def answer(self, request: ChatRequest, intents: sight.Intents = sight.knows_nothing) -> Answer:
        """Answer from the request and the list of intents alone."""
        heard = sight.read_conversation(request)
        if heard.role is ModelRole.VIEWER:
            return _describe_picture(request), ()
        try:
            if heard.role is ModelRole.READER:
                intent = intents(sight.instruction_in(request.messages))
                known = intent and _fenced("From my list:", intent_to_parts(intent))
                return known or UNKNOWN, ()
            task = sight.task_of(request.messages, intents)
        except sight.NothingSeen:
            return SEES_NOTHING, ()
        if heard.role is ModelRole.MODIFIER:
            return self._modify(task, heard)
        if heard.role is ModelRole.REVIEWER:
            return _rate(self.judge(task)), ()
        if any(message.role == "assistant" for message in request.messages):
            problems = self.judge(task)
            block = {"verdict": "feedback" if problems else "accept", "feedback": problems}
            return _fenced("I have weighed the answers.", block), ()
        names = list(sight.list_of(task.prompt, "Added agents"))[:6]
        questions = [f"In which lane does {name} stand?" for name in names]
        questions += ["Do any two blue objects overlap?", "Is a blue object off the road?"]
        questions += ["Is the ego alone in its lane?"]
        return _fenced("I ask the viewer.", {"questions": questions[:8]}), ()

    def _modify(self, task: sight.Task, heard: sight.Heard) -> Answer:
        if self.never_stops and (heard.may_call or heard.called):
            return _call(heard, [{"lane": "Lane1", "start": "lane", "distance_m": 1.0}])
        try:
            right = _placed(task, self.hear(task, heard))
        except CannotPlace as refused:
            reason = UNKNOWN if task.intent is None else refused.reason
            return _write_answer(task, Modification(), f"I did not understand it: {reason}"), ()
        numbered = (
            replace(agent, id=f"Agent{task.first_new + number}")
            for number, agent in enumerate(right.added)
        )
        placed = self.bend(task, replace(right, added=tuple(numbered)), heard)
        wanted = _calls_for(task.scene, placed)
        if heard.may_call and wanted and not heard.results:
            return _call(heard, wanted)
        placed = _with_results(task.scene, placed, heard.results)
        return self.spoil(task, _write_answer(task, placed), heard), ()


def _rate(problems: list[Problem]) -> str:
    found = "; ".join(problem["problem"] for problem in problems)
    ratings = dict(zip(_RATINGS, (2, 3, 2) if problems else (5, 5, 5), strict=True))
    return _fenced(
        "Summary: A road with the ego on it, and what the user wished for.\n\n"
        "Questions:\n1. Is everything where it was wished for?\n\n"
        f"Answers:\n1. {found or 'Nothing is to be corrected.'}\n\nRatings: See below.\n\n"
        "Review:",
        {"ratings": ratings, "feedback": problems},
    )


def problems_of(task: sight.Task) -> list[Problem]:
    """Return what is wrong with the work in the task, by the stand-in's own placement.

    Nothing where it does not know what the wish asks for.
    """
    try:
        right = list(place(task.scene, task.intent).modification.added)
    except CannotPlace:
        return []
    vectors = sight.list_of(task.prompt, "Added agents").items()
    added = [sight.agent_of(name, vector[:8]) for name, vector in vectors]
    if len(added) != len(right):
        said = f"{len(added)} agents were added, {len(right)} were asked for."
        return [_problem(said, "Count.")]
    problems = []
    for agent in added:
        meant = min(right, key=lambda one: _distance_m(one, agent))
        right.remove(meant)
        problem = _difference(agent, meant)
        if problem is not None:
            problems.append(problem)
    return problems


# --- Answers -----------------------------------------------------------------------------------


def _write_answer(task: sight.Task, modification: Modification, remark: str = "") -> str:
    """Write the paper's five sections around a modification."""
    steps = [
        f"Step {number}: {agent.id} is at ({agent.x_m:.2f}, {agent.y_m:.2f}); the heading is "
        f"{agent.heading_rad:.3f} rad."
        for number, agent in enumerate(modification.changed, start=1)
    ]
    named = [("add", agent.id) for agent in modification.added]
    named += [("move", agent.id) for agent in modification.moved]
    named += [("remove", name) for name in modification.removed]
    changes = [{"Action": action, "Modified_Agent": name} for action, name in named]
    scene = task.scene
    block = {
        "add": [_fields(agent) for agent in modification.added],
        "move": [_fields(agent) for agent in modification.moved],
        "remove": list(modification.removed),
    }
    insights = (
        f"The scene has {len(scene.lanes)} lanes and {len(scene.connectors)} connectors; besides "
        f"the ego there are {len(scene.agents)} agents. {remark}"
    )
    return (
        f"Insights: {insights.strip()}\n\n"
        f"Summary: The user wants: {' '.join(task.instruction.split())}\n\n"
        f"Modification Dict: {json.dumps(changes) if changes else 'none'}\n\n"
        f"Modification Calculations:\n{chr(10).join(steps) or 'none'}\n\n"
        f"Modified Vectors:\n```json\n{json.dumps(block, indent=1)}\n```\n"
    )


def _fields(agent: TrafficAgent) -> dict[str, object]:
    numbers = ("x_m", "y_m", "heading_rad", "width_m", "length_m", "speed_mps")
    fields: dict[str, object] = {"id": agent.id, "type": agent.type.value}
    for name in numbers:
        fields[name] = round(getattr(agent, name), 4 if name == "heading_rad" else 3)
    fields["lane"] = agent.lane_id
    if agent.type is AgentType.PEDESTRIAN and agent.walk_to_m is not None:
        fields["walk_to"] = [round(value, 3) for value in agent.walk_to_m]
    return fields


def _fenced(words: str, block: object) -> str:
    return f"{words}\n```json\n{json.dumps(block)}\n```\n"


def _describe_picture(request: ChatRequest) -> str:
    """Tell a viewer's questions what picture there is, and nothing that it can't see."""
    pictures = [png for message in request.messages for png in message.images]
    if not pictures:
        return "There is no picture."
    width, height = struct.unpack_from(">II", pictures[-1], 16)  # behind the PNG's signature
    count = len(re.findall(r"^[0-9]+\. ", request.messages[-1].text, re.MULTILINE)) or 1
    lines = [f"1. The picture has {width} x {height} pixels; more I cannot see."]
    return "\n".join(lines + [f"{number}. cannot see" for number in range(2, count + 1)])


# --- Placing and comparing ---------------------------------------------------------------------


def _placed(task: sight.Task, taken_for: Intent | None) -> Modification:
    """Place the wish as it was heard; what can't be placed is heard rightly."""
    if taken_for != task.intent:
        with suppress(CannotPlace):
            return place(task.scene, taken_for).modification
    return place(task.scene, task.intent).modification


def _difference(agent: TrafficAgent, meant: TrafficAgent) -> Problem | None:
    gap_m = _distance_m(agent, meant)
    turned = abs(difference(agent.heading_rad, meant.heading_rad))
    if agent.type is not meant.type:
        return _problem(f"{agent.id} is a {agent.type}, not a {meant.type}.", "Use that type.")
    if gap_m > _FAR_M:
        action = f"Move it to ({meant.x_m:.1f}, {meant.y_m:.1f})."
        return _problem(f"{agent.id} is {gap_m:.1f} m from where it belongs.", action)
    if agent.type in _VEHICLES and turned > _TURNED_RAD:
        said = f"{agent.id} is turned by {math.degrees(turned):.0f} degrees."
        return _problem(said, f"Turn it to {meant.heading_rad:.3f} rad.")
    return None


def _problem(said: str, action: str) -> Problem:
    reason = "The wish, worked out along the lanes, says otherwise."
    return {"problem": said, "reason": reason, "corrective_action": action}


def _distance_m(one: TrafficAgent, other: TrafficAgent) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


# --- Calls of the function ---------------------------------------------------------------------


def _call(heard: sight.Heard, wanted: Sequence[dict[str, object]]) -> Answer:
    calls = [(TOOL, json.dumps(arguments)) for arguments in wanted]
    if heard.is_native:
        return "", tuple(calls)
    lines = [f'{{"call": "{name}", "arguments": {arguments}}}' for name, arguments in calls]
    return "\n".join(["I look up the places that I need.\n", *lines]), ()


def _calls_for(scene: Scene, modification: Modification) -> list[dict[str, object]]:
    """Return the arguments of a call for each of the first added agents, in their order."""
    graph, ego = LaneGraph(scene), scene.ego
    wanted: list[dict[str, object]] = []
    for agent in modification.added[:_MOST_CALLS]:
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None:
            wanted.append({"lane": "Lane1", "start": "lane", "distance_m": 0.0})
            continue
        lane_id, at = nearest
        start, distance_m = "lane", at.s_m
        if lane_id == ego.lane_id:
            start = ego.id
            distance_m -= graph.lane(lane_id).centerline.project(ego.x_m, ego.y_m).s_m
        wanted.append(
            {
                "lane": lane_id,
                "start": start,
                "distance_m": round(distance_m, 3),
                "lateral_m": round(max(-30.0, min(30.0, at.d_m)), 3),
                "object": agent.type.value,
            }
        )
    return wanted


def _with_results(
    scene: Scene, modification: Modification, results: Sequence[dict[str, float] | None]
) -> Modification:
    """Put the added agents where the function says, turned against their lanes as before.

    Walks go along; agents without a result stay where they are.
    """
    graph = LaneGraph(scene)
    placed = list(modification.added)
    for number, (agent, result) in enumerate(zip(modification.added, results, strict=False)):
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None or result is None:
            continue
        x_m, y_m = float(result["x_m"]), float(result["y_m"])
        lane_rad = graph.lane(nearest[0]).centerline.heading_at(nearest[1].s_m)
        turn_rad = difference(agent.heading_rad, lane_rad)
        moved = careless.put(agent, x_m, y_m, wrap(float(result["heading_rad"]) + turn_rad))
        placed[number] = moved
    return replace(modification, added=tuple(placed))


# --- The characters ----------------------------------------------------------------------------


def _all_told(task: sight.Task, heard: sight.Heard) -> str:
    """Return the prompt and all feedback: a new round is a new throw of the dice."""
    return "\n".join([task.prompt, *heard.feedback])


def _mishear(task: sight.Task, heard: sight.Heard) -> Intent | None:
    if task.intent is None:
        return None
    return careless.misread(
        task.intent, careless.dice(f"{_all_told(task, heard)}\nas it was heard")
    )


def _bend(task: sight.Task, right: Modification, heard: sight.Heard) -> Modification:
    rng = careless.dice(_all_told(task, heard))
    if careless.is_unreadable(rng):
        return right
    has_tool = heard.called or heard.may_call
    shown = right if has_tool else careless.lay_straight(task.scene, right)
    spared = careless.SPARED_BY_TOOL if has_tool else frozenset()
    return careless.bend(task.scene, shown, rng, spared)[0]


def _mumble(task: sight.Task, text: str, heard: sight.Heard) -> str:
    rng = careless.dice(_all_told(task, heard))
    return text.partition("```")[0] if careless.is_unreadable(rng) else text


def _overlook(task: sight.Task) -> list[Problem]:
    """Find all problems or, as often, none."""
    return problems_of(task) if careless.dice(task.prompt).random() < 0.5 else []


GOOD = Character()
CARELESS = Character(hear=_mishear, bend=_bend, spoil=_mumble, judge=_overlook)
LEARNING = Character(
    bend=lambda task, right, heard: (
        right if heard.feedback else careless.too_far(task.scene, right)
    )
)
STUBBORN = Character(bend=lambda task, right, _: careless.too_far(task.scene, right))
LOOPING = Character(never_stops=True)
