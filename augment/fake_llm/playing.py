"""The stand-in's characters: each plays every role, in its own manner.

It places what the list of known tasks asks for by rules. As a reviewer it compares with that; as
a viewer it checks that there is a picture and says so: it is a stand-in without eyes. As a judge
it prefers the picture whose file is larger, in which more is drawn.
Frame: ego frame.
"""

import json
import math
import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from augment.baselines.rule_placer import place
from augment.checks.ground import VEHICLES, Ground
from augment.checks.parties import apart_m
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.fake_llm import careless, sight
from augment.fake_llm.searching import search
from augment.fake_llm.sight import Heard, KnownTasks, Task
from augment.fake_llm.wire import Calls, ChatRequest
from augment.geometry.frames import difference, wrap
from augment.prompts.calls import Tools
from augment.prompts.vectors import DEFAULT_RADIUS_M, lane_curves, motion_parts, short_names
from augment.scene.codec import intent_to_parts
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.motion import FloatArray, find_motion
from augment.variants.respondents import ModelRole

REFUSALS = (
    "Insights: {}\n\nSummary: none\n\nModification Dict: none\n\n"
    "Modification Calculations: none\n\nModified Vectors: none",
    "The wish can't be met: {}",
    "{} So I have to decline.",
    "Der Wunsch lässt sich nicht erfüllen: {}",
    "无法满足这个要求：{}",
)
UNKNOWN = "I am a stand-in and read no English; this sentence is not on my list of intents."

_MOST_CALLS = 8
_FAR_M, _BESIDE_M = 3.0, 1.0
_TURNED_RAD = math.radians(20.0)
_RATINGS = ("compliance", "realism", "logical_consistency")

Problem = dict[str, str]
Answer = tuple[str, Calls]
"""A text, native calls of functions, or both."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Character:
    """A manner of playing every role.

    Attributes:
        bend: What becomes of a right modification; None for an answer that nobody can read.
        judge: What a reviewer finds.
        in_prose: Whether it refuses wishes without a block.
        never_stops: Whether it calls as long as it may, and longer.
        leans: Whether as a judge it often prefers whatever comes first.
    """

    bend: Callable[[Task, Modification, Heard], Modification | None] = lambda _, right, __: right
    judge: Callable[[Task], list[Problem]] = lambda task: review_problems(task)
    in_prose: bool = False
    never_stops: bool = False
    leans: bool = False

    def answer(self, request: ChatRequest, tasks: KnownTasks = sight.knows_nothing) -> Answer:
        """Answer from the request and the list of known tasks alone."""
        heard = sight.read_conversation(request, tasks)
        task = heard.task
        if heard.role is ModelRole.VIEWER:
            return _describe_picture(request), ()
        if heard.role is ModelRole.JUDGE:
            return _compare_pictures(request, leans=self.leans), ()
        if heard.role is ModelRole.READER:
            return _fence("From my list:", intent_to_parts(task.intent)) if task else UNKNOWN, ()
        if heard.role is ModelRole.MODIFIER:
            return self._modify(heard)
        problems = self.judge(task) if task else []
        if heard.role is ModelRole.REVIEWER:
            return _rate(problems), ()
        if any(message.role == "assistant" for message in request.messages):
            block = {"verdict": "feedback" if problems else "accept", "feedback": problems}
            return _fence("I have weighed the answers.", block), ()
        names = [agent.id for agent in sight.read_changed_agents(task.prompt)] if task else []
        questions = [f"In which lane does {name} stand?" for name in names[:6]]
        questions += ["Do any two blue objects overlap?", "Is a blue object off the road?"]
        questions += ["Is the ego alone in its lane?"]
        return _fence("I ask the viewer.", {"questions": questions[:8]}), ()

    def _modify(self, heard: Heard) -> Answer:
        if self.never_stops and (heard.may_call or heard.called):
            return _call(heard, [_arguments(heard.tool, "Lane1", 1.0, 0.0, AgentType.VEHICLE)])
        task = heard.task
        if task is None:
            return _write_answer(Modification(), UNKNOWN), ()
        try:
            right = _find_right(task, heard)
        except CannotPlace as refused:
            if self.in_prose:
                rng = careless.dice(task.prompt)
                return rng.choice(REFUSALS).format(refused), ()
            return _write_answer(Modification(), f"I can't do it: {refused}"), ()
        placed = self.bend(task, right, heard)
        if placed is None:
            return "I know where it belongs, but not how to write it down.", ()
        wanted = _calls_for(task.scene, placed, heard.tool)
        if heard.may_call and wanted and not heard.results:
            return _call(heard, wanted)
        results = dict(zip(dict.fromkeys(wanted), heard.results, strict=False))
        poses = [results.get(arguments) for arguments in wanted]
        return _write_answer(_with_results(task.scene, placed, poses, heard.tool)), ()


def _rate(problems: list[Problem]) -> str:
    text = "; ".join(problem["problem"] for problem in problems)
    ratings = dict(zip(_RATINGS, (2, 3, 2) if problems else (5, 5, 5), strict=True))
    return _fence(
        "Summary: A road with the ego on it, and what the user wished for.\n\n"
        "Questions:\n1. Is everything where it was wished for?\n\n"
        f"Answers:\n1. {text or 'Nothing is to be corrected.'}\n\nRatings: See below.\n\n"
        "Review:",
        {"ratings": ratings, "feedback": problems},
    )


def review_problems(task: Task) -> list[Problem]:
    """Return the problems of the work in the task, by the stand-in's own placement."""
    changed = sight.read_changed_agents(task.prompt)
    if task.intent.purpose is not None:
        return _purpose_problems(task, changed)
    try:
        right = list(place(task.scene, task.intent).modification.changed)
    except CannotPlace:
        return []
    if len(changed) != len(right):
        text = f"{len(changed)} agents were added or moved, {len(right)} were asked for."
        return [_problem(text, "Count.")]
    some_move = any(agent.motion for agent in (*changed, *right))
    ways, right_ways = (
        _ways(task.scene, agents) if some_move else {} for agents in (changed, right)
    )
    problems = []
    for agent in changed:
        meant = min(right, key=lambda candidate: apart_m(candidate, agent))
        right.remove(meant)
        problem = _difference(agent, meant)
        if problem is None and some_move:
            problem = _motion_difference(agent, meant, ways[agent.id], right_ways[meant.id])
        if problem is not None:
            problems.append(problem)
    return problems


def _purpose_problems(task: Task, changed: Sequence[TrafficAgent]) -> list[Problem]:
    # Whoever is none of the scene's agents is added.
    change = Modification(moved=task.scene.agents).with_changed(changed)
    findings = check_against_intent(Ground.of(task.scene), change, task.intent)
    faults = [finding for finding in findings if finding.is_fault]
    return [_problem(fault.sentence(), "Place it otherwise.") for fault in faults]


# --- Answers -----------------------------------------------------------------------------------


def _write_answer(modification: Modification, remark: str = "") -> str:
    """Write the paper's five sections around a modification."""
    steps = [
        f"Step {number}: {agent.id} is at ({agent.x_m:.2f}, {agent.y_m:.2f})."
        for number, agent in enumerate(modification.changed, start=1)
    ]
    block = {
        "add": [_fields(agent) for agent in modification.added],
        "move": [_fields(agent) for agent in modification.moved],
        "remove": list(modification.removed),
    }
    return (
        f"Insights: {remark or 'The wish is on my list.'}\n\n"
        "Summary: What the user wants, by the list of intents.\n\n"
        f"Modification Dict: {len(modification.changed)} agents are added or moved.\n\n"
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
    if agent.motion is not None:
        fields["motion"] = motion_parts(agent.motion)
    return fields


def _fence(words: str, block: object) -> str:
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


def _compare_pictures(request: ChatRequest, *, leans: bool) -> str:
    """Decide by the sizes of the two files; who leans sometimes looks at nothing, or rambles."""
    pictures = request.messages[-1].images
    rng = careless.dice(str([careless.dice(repr(png)).random() for png in pictures]))
    if leans and careless.is_unreadable(rng):
        return "They are both nice pictures of a road."
    half = len(pictures) // 2  # of what moves there are frames as well
    first, other = (sum(map(len, pictures[half * side :][:half])) for side in (0, 1))
    better = "equal" if first == other else "A" if first > other else "B"
    if leans and rng.random() < 0.5:
        better = "A"
    reason = "I am a stand-in without eyes; I compare how much is drawn."
    return _fence("I have compared them.", {"better": better, "reason": reason})


# --- Comparing ---------------------------------------------------------------------------------


def _difference(agent: TrafficAgent, meant: TrafficAgent) -> Problem | None:
    gap_m = apart_m(agent, meant)
    turned = abs(difference(agent.heading_rad, meant.heading_rad))
    if agent.type is not meant.type:
        return _problem(f"{agent.id} is a {agent.type}, not a {meant.type}.", "Use that type.")
    if gap_m > _FAR_M:
        action = f"Move it to ({meant.x_m:.1f}, {meant.y_m:.1f})."
        return _problem(f"{agent.id} is {gap_m:.1f} m from where it belongs.", action)
    if agent.type in VEHICLES and turned > _TURNED_RAD:
        text = f"{agent.id} is turned by {math.degrees(turned):.0f} degrees."
        return _problem(text, f"Turn it to {meant.heading_rad:.3f} rad.")
    return None


def _ways(scene: Scene, agents: Sequence[TrafficAgent]) -> dict[str, FloatArray]:
    """Return where everybody is over time (T, 2), by id, with some that were changed."""
    names = {agent.id for agent in agents}
    others = tuple(agent for agent in scene.agents if agent.id not in names)
    motion = find_motion(replace(scene, agents=(*others, *agents)))
    return {movement.agent.id: movement.states[:, :2] for movement in motion.others}


def _motion_difference(
    agent: TrafficAgent, meant: TrafficAgent, way_m: FloatArray, right_m: FloatArray
) -> Problem | None:
    """Compare where they get to from where they begin; either may leave the map."""
    gone_m, right_gone_m = way_m - way_m[0], right_m - right_m[0]
    gap_m = float(np.nanmax(np.hypot(*(gone_m - right_gone_m).T)))
    if gap_m <= min(_FAR_M, 0.5 * float(np.nanmax(np.hypot(*right_gone_m.T)))):
        return None
    motion = json.dumps(motion_parts(meant.motion)) if meant.motion else "none"
    text = f"{agent.id} gets up to {gap_m:.0f} m away from where it is to be at that moment."
    return _problem(text, f"Its motion is to be {motion}.")


def _problem(sentence: str, action: str) -> Problem:
    reason = "The wish, worked out along the lanes, says otherwise."
    return {"problem": sentence, "reason": reason, "corrective_action": action}


# --- Calls of the function ---------------------------------------------------------------------


def _call(heard: Heard, wanted: Sequence[str]) -> Answer:
    """Call once for places that are the same: only so many identical calls are answered."""
    calls = [(heard.tool.value, arguments) for arguments in dict.fromkeys(wanted)]
    if heard.is_native:
        return "", tuple(calls)
    lines = [f'{{"call": "{name}", "arguments": {arguments}}}' for name, arguments in calls]
    return "\n".join(["I look up the places that I need.\n", *lines]), ()


def _arguments(tool: Tools, lane: str, s_m: float, d_m: float, kind: AgentType) -> str:
    """Return the arguments of a call for a place on a lane; the paper's takes no offset."""
    if tool is Tools.RETRIEVE:
        return json.dumps({"lane": lane, "agent": kind, "dist": s_m})
    place = {"lane": lane, "start": "lane", "distance_m": s_m}
    return json.dumps(place | {"lateral_m": d_m, "object": kind})


def _calls_for(scene: Scene, modification: Modification, tool: Tools) -> list[str]:
    """Return the arguments of a call for each of the first added agents, in their order.

    None where one stands beside no part of a lane that the prompt shows.
    """
    graph = LaneGraph(scene)
    shown = lane_curves(scene, short_names(scene), DEFAULT_RADIUS_M)
    wanted = []
    for agent in modification.added[:_MOST_CALLS]:
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None or nearest[0] not in shown:
            return []
        at = shown[nearest[0]].project(agent.x_m, agent.y_m)
        if at.beyond_m > _BESIDE_M:
            return []
        s_m, d_m = round(at.s_m, 3), round(max(-30.0, min(30.0, at.d_m)), 3)
        wanted.append(_arguments(tool, nearest[0], s_m, d_m, agent.type))
    return wanted


def _with_results(
    scene: Scene, modification: Modification, results: Sequence[list[float] | None], tool: Tools
) -> Modification:
    """Put the added agents where the function says, turned against their lanes as before.

    To what the paper's returns their offset is added. Walks go along; agents without a result
    stay where they are.
    """
    graph = LaneGraph(scene)
    placed = list(modification.added)
    for number, (agent, result) in enumerate(zip(modification.added, results, strict=False)):
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None or result is None:
            continue
        x_m, y_m, heading_rad = result
        if tool is Tools.RETRIEVE:
            # Left of a heading h is (-sin h, cos h).
            x_m -= nearest[1].d_m * math.sin(heading_rad)
            y_m += nearest[1].d_m * math.cos(heading_rad)
        lane_rad = graph.lane(nearest[0]).centerline.heading_at(nearest[1].s_m)
        turn_rad = difference(agent.heading_rad, lane_rad)
        placed[number] = careless.move_to(agent, x_m, y_m, wrap(heading_rad + turn_rad))
    return replace(modification, added=tuple(placed))


# --- The characters ----------------------------------------------------------------------------


def _find_right(task: Task, heard: Heard, *, misses: bool = False) -> Modification:
    """Return what rules place; where the wish is open the first that is found."""
    if task.intent.purpose is None:
        return place(task.scene, task.intent).modification
    dice = careless.dice(f"{heard.seed}\n{heard.all_told}")
    return search(task.scene, task.intent, dice, misses=misses)


def _bend(task: Task, right: Modification, heard: Heard) -> Modification | None:
    rng = careless.dice(heard.all_told)
    if careless.is_unreadable(rng):
        return None
    if task.intent.purpose is not None:
        return _find_right(task, heard, misses=True)
    spared = careless.SPARED_BY_TOOL if heard.called or heard.may_call else frozenset()
    return careless.bend(task.scene, right, rng, spared)[0]


GOOD = Character()
CARELESS = Character(
    bend=_bend,
    # As often as not it finds no problem.
    judge=lambda task: review_problems(task) if careless.dice(task.prompt).random() < 0.5 else [],
    leans=True,
)
LEARNING = Character(
    bend=lambda task, right, heard: (
        right if heard.feedback else careless.too_far(task.scene, right)
    )
)
STUBBORN = Character(bend=lambda task, right, _: careless.too_far(task.scene, right))
TALKATIVE = Character(in_prose=True)
LOOPING = Character(never_stops=True)
