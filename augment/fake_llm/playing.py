"""The stand-in's characters: each plays every role, in its own manner."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm import careless
from augment.fake_llm import careless as misreading
from augment.fake_llm.sight import (
    Heard,
    Intents,
    NothingSeen,
    Task,
    agent_of,
    instruction_in,
    knows_nothing,
    list_of,
    read_conversation,
    task_of,
)
from augment.fake_llm.wire import ChatRequest
from augment.geometry.frames import difference, wrap
from augment.prompts.vectors import compass
from augment.scene.codec import intent_to_parts
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.intent import Intent
from augment.scene.lane_graph import LaneGraph
from augment.variants.respondents import ModelRole

SEES_NOTHING = "I can't find a scene and an instruction in what I was given."


def write_answer(task: Task, modification: Modification, summary: str) -> str:
    """A whole answer: the modification, and how its numbers come about."""
    return _sections(
        insights=_road(task.scene),
        summary=summary,
        changes=_change_list(modification),
        calculations="\n".join(_steps(task.scene, modification)) or "Nothing is to be computed.",
        block=block_of(modification),
    )


def write_refusal(task: Task, reason: str) -> str:
    """An honest answer to what was not understood: readable, and nothing changes."""
    return _sections(
        insights=f"{_road(task.scene)} I did not understand the instruction: {reason}",
        summary="The instruction is not clear to me, so I leave the scene as it is.",
        changes="none",
        calculations="none",
        block=block_of(Modification()),
    )


def renumber_added(modification: Modification, first_new: int) -> Modification:
    """The added agents numbered on from the first new id of the task."""
    added = (replace(a, id=f"Agent{first_new + n}") for n, a in enumerate(modification.added))
    return replace(modification, added=tuple(added))


def block_of(modification: Modification) -> dict[str, object]:
    """The machine-read block of a modification."""
    return {
        "add": [_fields(agent) for agent in modification.added],
        "move": [_fields(agent) for agent in modification.moved],
        "remove": list(modification.removed),
    }


def _sections(
    *, insights: str, summary: str, changes: str, calculations: str, block: dict[str, object]
) -> str:
    return (
        f"Insights: {insights}\n\nSummary: {summary}\n\nModification Dict: {changes}\n\n"
        f"Modification Calculations:\n{calculations}\n\n"
        f"Modified Vectors:\n```json\n{json.dumps(block, indent=1)}\n```\n"
    )


def _road(scene: Scene) -> str:
    lanes = len(scene.connectors)
    ego_lane = LaneGraph(scene).under(0.0, 0.0, 0.0) or "no lane"
    crossing = f" and {lanes} lane connectors" if lanes else ", no intersection"
    return (
        f"The scene has {len(scene.lanes)} lanes{crossing}; the ego is on {ego_lane} and drives "
        f"eastwards. Traffic keeps {scene.traffic_side.value}. "
        f"Besides the ego there are {len(scene.agents)} agents."
    )


def _change_list(modification: Modification) -> str:
    named = [("add", agent.id) for agent in modification.added]
    named += [("move", agent.id) for agent in modification.moved]
    named += [("remove", name) for name in modification.removed]
    return json.dumps([{"Action": action, "Modified_Agent": name} for action, name in named])


def _steps(scene: Scene, modification: Modification) -> list[str]:
    graph = LaneGraph(scene)
    route = EgoRoute.of(scene, graph)
    steps: list[str] = []
    for agent in modification.changed:
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None:
            continue
        lane_id, place = nearest
        line = graph.lanes[lane_id].centerline
        x_m, y_m = line.position(place.s_m)
        where = _ahead(graph, route, lane_id, place.s_m)
        steps.append(
            f"Step {len(steps) + 1}: {agent.id} lies {where}. The "
            f"centreline of {lane_id} is at ({x_m:.2f}, {y_m:.2f}) there and leads "
            f"{compass(line.heading_at(place.s_m))} ({line.heading_at(place.s_m):.3f} rad). "
            f"{abs(place.d_m):.2f} m to its {'left' if place.d_m >= 0.0 else 'right'} is "
            f"({agent.x_m:.2f}, {agent.y_m:.2f}); the heading is {agent.heading_rad:.3f} rad."
        )
    return steps


def _ahead(graph: LaneGraph, route: EgoRoute | None, lane_id: str, s_m: float) -> str:
    """Where a place on a way lies, along the lanes where the ego's own lead there."""
    line = graph.lane(lane_id).centerline
    if route is not None and lane_id in route.lane_ids:
        end_m = route.ends_m[route.lane_ids.index(lane_id)]
        along_m = end_m - line.length_m + s_m
        return f"{along_m:.2f} m along the lanes from the ego, on {lane_id}"
    x_m, y_m = line.position(s_m)
    return f"{math.hypot(x_m, y_m):.2f} m from the ego, on {lane_id}"


def _fields(agent: TrafficAgent) -> dict[str, object]:
    fields: dict[str, object] = {
        "id": agent.id,
        "type": agent.type.value,
        "x_m": round(agent.x_m, 3),
        "y_m": round(agent.y_m, 3),
        "heading_rad": round(agent.heading_rad, 4),
        "width_m": round(agent.width_m, 3),
        "length_m": round(agent.length_m, 3),
        "speed_mps": round(agent.speed_mps, 3),
        "lane": agent.lane_id,
    }
    if agent.type is AgentType.PEDESTRIAN and agent.walk_to_m is not None:
        fields["walk_to"] = [round(value, 3) for value in agent.walk_to_m]
    return fields


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


TOOL = "pose_on_lane"
_MOST_CALLS = 8
_LANE = "lane"


def calls_for(scene: Scene, modification: Modification) -> list[dict[str, object]]:
    """The arguments of one call for each of the first added agents, in their order."""
    graph = LaneGraph(scene)
    return [_arguments(graph, scene.ego, agent) for agent in modification.added[:_MOST_CALLS]]


def with_results(
    scene: Scene, modification: Modification, results: Sequence[dict[str, object] | None]
) -> Modification:
    """The added agents where the function says; those without a result stay where they are."""
    graph = LaneGraph(scene)
    pairs = zip(modification.added, results, strict=False)
    placed = [agent if one is None else _placed(graph, agent, one) for agent, one in pairs]
    return replace(modification, added=(*placed, *modification.added[len(placed) :]))


def _arguments(graph: LaneGraph, ego: TrafficAgent, agent: TrafficAgent) -> dict[str, object]:
    nearest = graph.nearest(agent.x_m, agent.y_m)
    if nearest is None:
        return {"lane": "Lane1", "start": _LANE, "distance_m": 0.0}
    lane_id, place = nearest
    start, distance_m = _LANE, place.s_m
    if lane_id == ego.lane_id:
        start = ego.id
        distance_m -= graph.lane(lane_id).centerline.project(ego.x_m, ego.y_m).s_m
    return {
        "lane": lane_id,
        "start": start,
        "distance_m": round(distance_m, 3),
        "lateral_m": round(max(-30.0, min(30.0, place.d_m)), 3),
        "object": agent.type.value,
    }


def _placed(graph: LaneGraph, agent: TrafficAgent, result: dict[str, object]) -> TrafficAgent:
    """The agent at the pose, turned against the lane as before; its walk goes along."""
    nearest = graph.nearest(agent.x_m, agent.y_m)
    if nearest is None:
        return agent
    x_m, y_m, heading_rad = (float(str(result[n])) for n in ("x_m", "y_m", "heading_rad"))
    lane_rad = graph.lane(nearest[0]).centerline.heading_at(nearest[1].s_m)
    walk = agent.walk_to_m
    if walk is not None:
        walk = (walk[0] + x_m - agent.x_m, walk[1] + y_m - agent.y_m)
    return replace(
        agent,
        x_m=x_m,
        y_m=y_m,
        heading_rad=wrap(heading_rad + difference(agent.heading_rad, lane_rad)),
        walk_to_m=walk,
    )


UNKNOWN = "I am a stand-in and read no English; this sentence is not on my list of intents."

Calls = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """An answer: a text, native calls of functions (name, arguments), or both."""

    text: str
    calls: Calls = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Character:
    """A manner of playing every role.

    Attributes:
        hear: What it takes the wish to be, given the task and what was heard.
        bend: What becomes of a right modification, given the task and what was heard.
        spoil: What becomes of a modifier's finished answer.
        judge: What a reviewer finds.
        rate: A reviewer's answer.
        decide: An engineer's verdict.
        first_calls: Calls that come before the right ones: name and arguments as written.
        never_stops: Whether it calls as long as it may, and longer.
    """

    hear: Callable[[Task, Heard], Intent | None] = lambda task, _: task.intent
    bend: Callable[[Task, Modification, Heard], Modification] = lambda task, right, _: right
    spoil: Callable[[Task, str, Heard], str] = lambda task, text, _: text
    judge: Callable[[Task], list[Problem]] = problems_of
    rate: Callable[[Sequence[Problem]], str] = write_ratings
    decide: Callable[[Sequence[Problem]], str] = write_verdict
    first_calls: Calls = ()
    never_stops: bool = False

    def answer(self, request: ChatRequest, intents: Intents = knows_nothing) -> Said:
        """What it says, from the request and the list of intents alone."""
        understood = read_conversation(request)
        if understood.part is ModelRole.VIEWER:
            return Said(text=describe_picture(request))
        if understood.part is ModelRole.READER:
            return self._read(request, intents)
        try:
            task = task_of(request.messages, intents)
        except NothingSeen:
            return Said(text=SEES_NOTHING)
        match understood.part:
            case ModelRole.MODIFIER:
                return self._modified(task, understood)
            case ModelRole.REVIEWER:
                return Said(text=self.rate(self.judge(task)))
        if any(one.role == "assistant" for one in request.messages):
            return Said(text=self.decide(self.judge(task)))
        return Said(text=write_questions(list(list_of(task.prompt, "Added agents"))))

    def _read(self, request: ChatRequest, intents: Intents) -> Said:
        """The intent from the list, as a reader would write it; nothing is read."""
        try:
            intent = intents(instruction_in(request.messages))
        except NothingSeen:
            return Said(text=SEES_NOTHING)
        if intent is None:
            return Said(text=UNKNOWN)
        return Said(text=f"From my list:\n```json\n{json.dumps(intent_to_parts(intent))}\n```\n")

    def _modified(self, task: Task, understood: Heard) -> Said:
        if self.never_stops and (understood.may_call or understood.called):
            return _calling(understood, _endless())
        if self.first_calls and understood.may_call and not understood.called:
            return _calling(understood, self.first_calls)
        try:
            right = _placed_playing(task, self.hear(task, understood))
        except CannotPlace as refused:
            return Said(text=write_refusal(task, _why(task, refused)))
        placed = self.bend(task, renumber_added(right, task.first_new), understood)
        wanted = calls_for(task.scene, placed)
        spared = len(self.first_calls)
        if understood.may_call and wanted and len(understood.results) <= spared:
            return _calling(understood, _named(wanted[: 8 - spared]))
        results = understood.results[spared:]
        placed = with_results(task.scene, placed, results)
        text = write_answer(task, placed, _summary(task))
        return Said(text=self.spoil(task, text, understood))


def _placed_playing(task: Task, taken_for: Intent | None) -> Modification:
    """What is placed for the wish as it was heard; what can't be placed is heard rightly."""
    if taken_for != task.intent:
        with suppress(CannotPlace):
            return place(task.scene, taken_for).modification
    return place(task.scene, task.intent).modification


def _why(task: Task, refusal: CannotPlace) -> str:
    if task.intent is None:
        return UNKNOWN
    return refusal.reason


def _calling(understood: Heard, calls: Calls) -> Said:
    if understood.is_native:
        return Said(text="", calls=calls)
    lines = "\n".join(
        f'{{"call": {json.dumps(name)}, "arguments": {arguments}}}' for name, arguments in calls
    )
    return Said(text=f"I look up the places that I need.\n\n{lines}")


def _named(wanted: Sequence[dict[str, object]]) -> Calls:
    return tuple((TOOL, json.dumps(one)) for one in wanted)


def _endless() -> Calls:
    return _named([{"lane": "Lane1", "start": "lane", "distance_m": 1.0}])


def _summary(task: Task) -> str:
    return f"The user wants: {' '.join(task.instruction.split())}"


def _misheard(task: Task, understood: Heard) -> Intent | None:
    if task.intent is None:
        return None
    rng = careless.dice(f"{_all_told(task, understood)}\nas it was heard")
    return misreading.misread(task.intent, rng)


def _careless(task: Task, right: Modification, understood: Heard) -> Modification:
    rng = careless.dice(_all_told(task, understood))
    if careless.is_unreadable(rng):
        return right
    spared = careless.SPARED_BY_TOOL if understood.called or understood.may_call else frozenset()
    if not spared:
        right = careless.lay_straight(task.scene, right)
    return careless.bend(task.scene, right, rng, spared).modification


def _mumbled(task: Task, text: str, understood: Heard) -> str:
    rng = careless.dice(_all_told(task, understood))
    return text.partition("```")[0] if careless.is_unreadable(rng) else text


def _all_told(task: Task, understood: Heard) -> str:
    """The prompt and all feedback: a new round is a new throw of the dice."""
    return "\n".join([task.prompt, *understood.feedback])


def _overlooking(task: Task) -> list[Problem]:
    return overlook_some(problems_of(task), careless.dice(task.prompt))


def _learning(task: Task, right: Modification, understood: Heard) -> Modification:
    """Too far at first, right after feedback."""
    return right if understood.feedback else careless.too_far(task.scene, right)


def _stubborn(task: Task, right: Modification, _: Heard) -> Modification:
    return careless.too_far(task.scene, right)


def _in_words(problems: Sequence[Problem]) -> str:
    """Ratings as words, which is none of a reviewer's scale."""
    block = {"ratings": dict.fromkeys(("compliance", "realism", "logical_consistency"), "four")}
    return f"Review:\n```json\n{json.dumps(block | {'feedback': []})}\n```\n"


def _perhaps(problems: Sequence[Problem]) -> str:
    return 'It depends.\n```json\n{"verdict": "perhaps", "feedback": []}\n```\n'


GOOD = Character()
CARELESS = Character(hear=_misheard, bend=_careless, spoil=_mumbled, judge=_overlooking)
LEARNING = Character(bend=_learning)
STUBBORN = Character(bend=_stubborn)
NONNUMERIC = Character(rate=_in_words, decide=_perhaps)
LOOPING = Character(never_stops=True)
MISNAMING = Character(first_calls=(("nearest_lane", '{"x_m": 20.0, "y_m": 0.0}'),))
MISCALLING = Character(
    first_calls=(
        (TOOL, '{"lane": "Lane1", "start": "lane"'),
        (TOOL, '{"lane": "Lane1", "start": "lane", "distance_m": "ten metres"}'),
    )
)
