"""The stand-in's characters: each plays every role, in its own manner."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm import answers, careless, judging, misreading, tool_use
from augment.fake_llm.hearing import Heard, read_conversation
from augment.fake_llm.requests import ChatRequest
from augment.fake_llm.sight import (
    Intents,
    NothingSeen,
    Task,
    instruction_in,
    knows_nothing,
    list_of,
    task_of,
)
from augment.scene.codec import intent_to_parts
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from augment.variants.transcript import ModelRole

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
    judge: Callable[[Task], list[judging.Problem]] = judging.problems_of
    rate: Callable[[Sequence[judging.Problem]], str] = judging.write_ratings
    decide: Callable[[Sequence[judging.Problem]], str] = judging.write_verdict
    first_calls: Calls = ()
    never_stops: bool = False

    def answer(self, request: ChatRequest, intents: Intents = knows_nothing) -> Said:
        """What it says, from the request and the list of intents alone."""
        understood = read_conversation(request)
        if understood.part is ModelRole.VIEWER:
            return Said(text=judging.describe_picture(request))
        if understood.part is ModelRole.READER:
            return self._read(request, intents)
        try:
            task = task_of(request.messages, intents)
        except NothingSeen:
            return Said(text=answers.SEES_NOTHING)
        match understood.part:
            case ModelRole.MODIFIER:
                return self._modified(task, understood)
            case ModelRole.REVIEWER:
                return Said(text=self.rate(self.judge(task)))
        if any(one.role == "assistant" for one in request.messages):
            return Said(text=self.decide(self.judge(task)))
        return Said(text=judging.write_questions(list(list_of(task.prompt, "Added agents"))))

    def _read(self, request: ChatRequest, intents: Intents) -> Said:
        """The intent from the list, as a reader would write it; nothing is read."""
        try:
            intent = intents(instruction_in(request.messages))
        except NothingSeen:
            return Said(text=answers.SEES_NOTHING)
        if intent is None:
            return Said(text=UNKNOWN)
        return Said(text=f"From my list:\n```json\n{json.dumps(intent_to_parts(intent))}\n```\n")

    def _modified(self, task: Task, understood: Heard) -> Said:
        if self.never_stops and (understood.may_call or understood.called):
            return _calling(understood, _endless())
        if self.first_calls and understood.may_call and not understood.called:
            return _calling(understood, self.first_calls)
        try:
            right = _placed(task, self.hear(task, understood))
        except CannotPlace as refused:
            return Said(text=answers.write_refusal(task, _why(task, refused)))
        placed = self.bend(task, answers.renumber_added(right, task.first_new), understood)
        wanted = tool_use.calls_for(task.scene, placed)
        spared = len(self.first_calls)
        if understood.may_call and wanted and len(understood.results) <= spared:
            return _calling(understood, _named(wanted[: 8 - spared]))
        results = understood.results[spared:]
        placed = tool_use.with_results(task.scene, placed, results)
        text = answers.write_answer(task, placed, _summary(task))
        return Said(text=self.spoil(task, text, understood))


def _placed(task: Task, taken_for: Intent | None) -> Modification:
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
    return tuple((tool_use.TOOL, json.dumps(one)) for one in wanted)


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


def _overlooking(task: Task) -> list[judging.Problem]:
    return judging.overlook_some(judging.problems_of(task), careless.dice(task.prompt))


def _learning(task: Task, right: Modification, understood: Heard) -> Modification:
    """Too far at first, right after feedback."""
    return right if understood.feedback else careless.too_far(task.scene, right)


def _stubborn(task: Task, right: Modification, _: Heard) -> Modification:
    return careless.too_far(task.scene, right)


def _in_words(problems: Sequence[judging.Problem]) -> str:
    """Ratings as words, which is none of a reviewer's scale."""
    block = {"ratings": dict.fromkeys(("compliance", "realism", "logical_consistency"), "four")}
    return f"Review:\n```json\n{json.dumps(block | {'feedback': []})}\n```\n"


def _perhaps(problems: Sequence[judging.Problem]) -> str:
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
        (tool_use.TOOL, '{"lane": "Lane1", "start": "lane"'),
        (tool_use.TOOL, '{"lane": "Lane1", "start": "lane", "distance_m": "ten metres"}'),
    )
)
