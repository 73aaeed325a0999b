"""What the modifier is told: prompt texts filled with a scene, an instruction and what came back.

In: a `Scene`, an instruction, and the form of a variant (polylines or Bezier curves, with or
without calls); later on what was answered, called and found. Out: `Message`s, ready to be sent.

What is the same for every scenario comes first, then the scene, then the instruction, so that an
endpoint can reuse the unchanged beginning.
"""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files

from augment.checks.tolerances import USUAL, Tolerances
from augment.errors import InvalidDocument, ReplyUnreadable
from augment.llm.messages import Message, Speaker, Tool
from augment.prompts.blocks import last_object, names_changes
from augment.prompts.calls import calls_in
from augment.prompts.extent import BESIDE_M, CROSSED_M, behind_m
from augment.prompts.vectors import DEFAULT_RADIUS_M, LaneFormat, changes_text, scene_text
from augment.scene.entities import Scene
from augment.scene.intent import Intent
from augment.scene.intent_codec import intent_from_parts, parts_schema
from augment.scene.modification import Modification

QUOTE = "> "
"""Stands before every line of somebody else's words: no line of them can end the quotation."""

LONGEST_ECHO = 20_000

VECTORS_VERSION = 4
"""Raised with every change to what of a scene is written down, or how: no text shows that."""


@cache
def prompt_version() -> str:
    """Twelve hexadecimal digits that change with every change to any prompt text or form."""
    digest = hashlib.sha256(b"vectors %d\0" % VECTORS_VERSION)
    for entry in sorted(files(__package__).joinpath("text").iterdir(), key=lambda e: e.name):
        digest.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


@cache
def read_text(name: str) -> str:
    """The text of that name as it stands in its file."""
    return files(__package__).joinpath("text", name).read_text(encoding="utf-8").strip()


def fill_text(name: str, **values: str) -> str:
    """The text with each {{name}} replaced once; what is filled in is not looked at again.

    Raises:
        KeyError: A name has no value.
    """
    parts = []
    rest = read_text(name)
    while "{{" in rest:
        before, _, rest = rest.partition("{{")
        key, _, rest = rest.partition("}}")
        parts += [before, values[key]]
    return re.sub(r"\n{3,}", "\n\n", "".join([*parts, rest])).strip()


def quote(words: str) -> str:
    """Somebody's words as a quotation, line by line, without control characters."""
    clean = ("".join(map(_printable, line)).strip() for line in words.splitlines())
    return "\n".join(QUOTE + line for line in clean if line)


def model_message(answer: str) -> Message:
    """A turn of the model; an empty one is refused by several servers."""
    return Message(speaker=Speaker.ASSISTANT, text=answer[:LONGEST_ECHO] or "(empty answer)")


def said_by_user(words: str, *, images: tuple[bytes, ...] = ()) -> Message:
    """A turn of whoever talks to the model."""
    return Message(speaker=Speaker.USER, text=words, images=images)


def number_lines(entries: Sequence[str]) -> str:
    """The entries as a numbered list, each on one line."""
    return "\n".join(f"{n}. {' '.join(entry.split())}" for n, entry in enumerate(entries, 1))


def _printable(character: str) -> str:
    return " " if unicodedata.category(character).startswith("C") else character


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


CANNOT_SEE = "cannot see"


def reviewer_messages(
    scene: Scene,
    instruction: str,
    modification: Modification,
    *,
    radius_m: float,
    earlier: Sequence[str] = (),
) -> tuple[Message, ...]:
    """What the text reviewer is asked: scene, wish and changed vectors, no reasoning.

    Args:
        scene: The scene before the change.
        instruction: The user's wish.
        modification: What is reviewed.
        radius_m: How far around the ego the scene is written down.
        earlier: The feedback that the editor was given in earlier rounds.
    """
    told = fill_text("reviewer.md", **_rules(radius_m), problems=read_text("common_problems.md"))
    task = _task(scene, instruction, modification, radius_m, earlier)
    return Message(speaker=Speaker.SYSTEM, text=told), said_by_user(task)


def engineer_messages(
    scene: Scene,
    instruction: str,
    modification: Modification,
    *,
    radius_m: float,
    earlier: Sequence[str] = (),
) -> tuple[Message, ...]:
    """What the engineer is asked first: for questions to the viewer; arguments as above."""
    told = fill_text("engineer.md", **_rules(radius_m), drawn=read_text("drawn.md"))
    task = _task(scene, instruction, modification, radius_m, earlier)
    return Message(speaker=Speaker.SYSTEM, text=told), said_by_user(task)


def viewer_messages(questions: Sequence[str], pictures: Sequence[bytes]) -> tuple[Message, ...]:
    """What the viewer is asked: the questions, about the pictures (PNG)."""
    task = fill_text("viewer_task.md", questions=number_lines(questions))
    return (
        Message(speaker=Speaker.SYSTEM, text=fill_text("viewer.md", drawn=read_text("drawn.md"))),
        said_by_user(task, images=tuple(pictures)),
    )


def verdict_messages(
    messages: tuple[Message, ...], questions: Sequence[str], answers: Mapping[int, str]
) -> tuple[Message, ...]:
    """The engineer's conversation up to his questions, and what the viewer saw."""
    lines = [
        f"{n}. {' '.join(question.split())} -> {answers.get(n, CANNOT_SEE)}"
        for n, question in enumerate(questions, start=1)
    ]
    told = fill_text("engineer_answers.md", answers=quote("\n".join(lines)))
    return (*messages, said_by_user(told))


def review_re_ask_messages(
    messages: tuple[Message, ...], answer: str, problems: Sequence[str]
) -> tuple[Message, ...]:
    """The conversation so far, the answer that can't be read, and what is wrong with it."""
    asked = fill_text("review_re_ask.md", problems="\n".join(f"- {one}" for one in problems))
    return (*messages, model_message(answer), said_by_user(asked))


def viewer_re_ask_messages(messages: tuple[Message, ...], answer: str) -> tuple[Message, ...]:
    """The viewer's conversation with an answer that answers nothing; the picture stays in it."""
    return (*messages, model_message(answer), said_by_user(read_text("viewer_re_ask.md")))


def _rules(radius_m: float) -> dict[str, str]:
    """What the editor was told and what is a deviation from it, the same for every reviewer."""
    return {
        "input_format": input_format(radius_m),
        "distances": read_text("distances_walked.md"),
        "rules": read_text("rules.md"),
        "tolerances": tolerances_text(USUAL),
    }


def tolerances_text(allowed: Tolerances) -> str:
    """From when on a deviation is a problem: what the program's own checks go by."""
    return fill_text(
        "tolerances.md",
        distance_m=f"{allowed.distance_m:g}",
        distance_percent=f"{100.0 * allowed.distance_share:g}",
        across_m=f"{allowed.across_m:g}",
        middle_m=f"{allowed.middle_m:g}",
        heading_deg=f"{allowed.heading_deg:g}",
        spacing_m=f"{allowed.spacing_m:g}",
        spacing_percent=f"{100.0 * allowed.spacing_share:g}",
    )


def _task(
    scene: Scene,
    instruction: str,
    modification: Modification,
    radius_m: float,
    earlier: Sequence[str],
) -> str:
    told = "\n".join(earlier)
    return fill_text(
        "review_task.md",
        scene=scene_text(scene, radius_m=radius_m),
        quoted=quote(instruction),
        changes=changes_text(scene, modification),
        earlier=fill_text("earlier_feedback.md", quoted=quote(told)) if earlier else "",
    )


_MOST_PROBLEMS = 8


def reader_messages(instruction: str) -> tuple[Message, ...]:
    """The rules with the JSON schema, and the sentence."""
    system = fill_text("reader.md", schema=_schema())
    task = fill_text("reader_task.md", quoted=quote(instruction))
    return Message(speaker=Speaker.SYSTEM, text=system), said_by_user(task)


def read_intent(answer: str) -> Intent:
    """The intent of a reader's answer.

    Raises:
        ReplyUnreadable: There is no block, or it breaks the schema or contradicts itself.
    """
    found, _ = last_object(answer, frozenset({"requests"}))
    try:
        return intent_from_parts(found)
    except InvalidDocument as fault:
        problems = fault.problems[:_MOST_PROBLEMS]
    raise ReplyUnreadable(
        [f"{ascii(path).strip(chr(39))[:80]}: {text}" for path, text in problems]
    )


@cache
def _schema() -> str:
    return json.dumps(parts_schema(), separators=(",", ":"))
