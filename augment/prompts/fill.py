"""What the modifier is told: prompt texts filled with a scene, an instruction and what came back.

In: a `Scene`, an instruction, and the form of a variant (polylines or Bezier curves, with or
without calls); later on what was answered, called and found. Out: `Message`s, ready to be sent.

What is the same for every scenario comes first, then the scene, then the instruction, so that an
endpoint can reuse the unchanged beginning.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

from augment.llm.messages import Message, Speaker, Tool
from augment.prompts.blocks import names_changes
from augment.prompts.calls import calls_in
from augment.prompts.extent import BESIDE_M, CROSSED_M, behind_m
from augment.prompts.texts import (
    QUOTE,
    fill_text,
    model_message,
    prompt_version,
    quote,
    read_text,
    said_by_user,
)
from augment.prompts.vectors import DEFAULT_RADIUS_M, LaneFormat, scene_text
from augment.scene.entities import Scene

__all__ = ["QUOTE", "Calling", "Form", "modifier_messages", "prompt_version", "quote"]


class Calling(StrEnum):
    """How the modifier calls the pose tool: not at all, by a line of its answer, or natively."""

    NONE = "none"
    IN_PROMPT = "in_prompt"
    NATIVE = "native"


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """In which form the modifier gets its task.

    Attributes:
        lanes: How lanes are written down.
        radius_m: How far around the ego the scene is written down.
        calls, identical: How many calls are answered, and of these the very same.
    """

    lanes: LaneFormat = LaneFormat.POLYLINE
    calling: Calling = Calling.NONE
    radius_m: float = DEFAULT_RADIUS_M
    calls: int = 8
    identical: int = 3


def modifier_messages(
    scene: Scene, instruction: str, form: Form | None = None
) -> tuple[Message, ...]:
    """What the modifier is asked first."""
    form = form or Form()
    task = fill_text(
        "task.md",
        scene=scene_text(scene, radius_m=form.radius_m, lanes=form.lanes),
        quoted=quote(instruction),
    )
    return Message(speaker=Speaker.SYSTEM, text=_modifier(form)), said_by_user(task)


def re_ask_messages(
    messages: tuple[Message, ...], answer: str, problems: Sequence[str]
) -> tuple[Message, ...]:
    """The conversation so far, the answer that can't be read, and what is wrong with it.

    Only an answer that holds a block is told to keep its placement.
    """
    told = [*problems, read_text("re_ask_calls.md")] if calls_in(answer) else problems
    keep = read_text("re_ask_keep.md") if names_changes(answer) else ""
    asked = fill_text("re_ask.md", problems=_listed(told), keep=keep)
    return (*messages, model_message(answer), said_by_user(asked))


def regenerate_messages(
    messages: tuple[Message, ...], feedback: Sequence[str], *, is_measured: bool
) -> tuple[Message, ...]:
    """The conversation so far, and what a review found about its last answer.

    Args:
        messages: Up to and including that answer.
        feedback: One entry a problem.
        is_measured: Whether these are measured facts rather than somebody's opinion.
    """
    words = fill_text("measured.md" if is_measured else "feedback.md", feedback=_listed(feedback))
    return (*messages, said_by_user(words))


def result_text(results: Sequence[str], *, is_over: bool) -> str:
    """What the program says about calls made in the prompt: each result as one line of JSON."""
    lines = "\n".join(f"{number}. {result}" for number, result in enumerate(results, start=1))
    return fill_text("function_result.md", results=lines, rest=go_on_text(is_over=is_over))


def go_on_text(*, is_over: bool) -> str:
    """Whether more calls are answered."""
    return read_text("calls_are_over.md" if is_over else "calls_go_on.md")


@cache
def pose_tool() -> Tool:
    """The pose tool as endpoints with native calls are told of it."""
    function = json.loads(read_text("pose_on_lane.json"))["function"]
    return Tool(
        name=function["name"],
        description=function["description"],
        parameters=function["parameters"],
    )


def input_format(radius_m: float, lanes: LaneFormat = LaneFormat.POLYLINE) -> str:
    """How a scene is written down, and which part of it."""
    return fill_text(
        "input_format.md",
        coordinates=read_text(f"lanes_{lanes}.md"),
        radius_m=f"{radius_m:g}",
        behind_m=f"{behind_m(radius_m):g}",
        beside_m=f"{BESIDE_M:g}",
        crossed_m=f"{CROSSED_M:g}",
    )


_WORK = {Calling.NONE: "walked", Calling.IN_PROMPT: "called", Calling.NATIVE: "native"}


@cache
def _modifier(form: Form) -> str:
    tools = ""
    if form.calling is not Calling.NONE:
        tools = fill_text(
            f"calls_{form.calling}.md",
            function=read_text("pose_on_lane.md"),
            calls=str(form.calls),
            identical=str(form.identical),
        )
    manner = "walked" if form.calling is Calling.NONE else "called"
    return fill_text(
        "modifier.md",
        input_format=input_format(form.radius_m, form.lanes),
        distances=read_text(f"distances_{manner}.md"),
        rules=read_text("rules.md"),
        tools=tools,
        calculations=read_text(f"calculations_{manner}.md"),
        example=read_text(f"example_{form.lanes}.md"),
        work=read_text(f"work_{_WORK[form.calling]}.md"),
    )


def _listed(entries: Sequence[str]) -> str:
    return "\n".join(f"- {entry}" for entry in entries)
