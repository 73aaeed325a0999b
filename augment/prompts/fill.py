"""Texts for models: prompts filled with a scene, an instruction and earlier answers.

In: a `Scene`, an instruction, and the form of a variant (polylines or Bezier curves, with or
without calls); later on what was answered, called and found. Out: `Message`s, ready to be sent.

What is the same for every scenario comes first, then the scene, then the instruction, so that an
endpoint can reuse the unchanged beginning. Reviewers get the scene as polylines whatever the
modifier got: they have no tool to walk along curves. The texts are package data under `text/`.
"""

import hashlib
import json
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files

from augment.checks.parties import USUAL
from augment.llm.messages import Message, Speaker, Tool
from augment.prompts.blocks import names_changes
from augment.prompts.calls import PARAMETERS, Tools, calls_in
from augment.prompts.extent import BESIDE_M, CROSSED_M, behind_m
from augment.prompts.vectors import DEFAULT_RADIUS_M, LaneFormat, changes_text, scene_text
from augment.scene.codec import parts_schema
from augment.scene.entities import Modification, Scene

QUOTE = "> "
"""Stands before every line of somebody else's words: no line of them can end the quotation."""
LONGEST_ECHO = 20_000
CANNOT_SEE = "cannot see"
VECTORS_VERSION = 5
"""Raised with every change to what of a scene is written down, or how: no text shows that."""

Messages = tuple[Message, ...]
Shown = tuple[bytes, ...]
"""What a judge sees of one side (PNG): the still, and of what moves a sheet of frames."""


class JudgeQuestion(StrEnum):
    """Criterion by which a judge compares two pictures."""

    INSTRUCTION = "instruction"
    REALISM = "realism"
    DIFFICULTY = "difficulty"


@dataclass(frozen=True, slots=True, kw_only=True)
class PromptOptions:
    """Options of a modifier's prompt.

    Attributes:
        lanes: How lanes are written down.
        tools: The function that it may have called.
        is_native: Whether natively rather than by a line of the answer.
        radius_m: How far around the ego the scene is written down.
        calls, identical: How many calls are answered, and of these the very same.
    """

    lanes: LaneFormat = LaneFormat.POLYLINE
    tools: Tools = Tools.NONE
    is_native: bool = False
    radius_m: float = DEFAULT_RADIUS_M
    calls: int = 8
    identical: int = 3


@cache
def prompt_version() -> str:
    """Return twelve hexadecimal digits that change with every change to any prompt text."""
    digest = hashlib.sha256(b"vectors %d\0" % VECTORS_VERSION)
    for entry in sorted(files(__package__).joinpath("text").iterdir(), key=lambda e: e.name):
        digest.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


@cache
def read_text(name: str) -> str:
    """Return the text of that name as it stands in its file."""
    return files(__package__).joinpath("text", name).read_text(encoding="utf-8").strip()


def fill_text(name: str, **values: str) -> str:
    """Return the text with each {{name}} replaced once; what is filled in is not looked at again.

    Raises:
        KeyError: A name has no value.
    """
    filled = re.sub(r"\{\{(.*?)\}\}", lambda match: values[match[1]], read_text(name))
    return re.sub(r"\n{3,}", "\n\n", filled).strip()


def quote(words: str) -> str:
    """Quote somebody's words line by line, without control characters."""
    clean = (
        "".join(" " if unicodedata.category(c).startswith("C") else c for c in line).strip()
        for line in words.splitlines()
    )
    return "\n".join(QUOTE + line for line in clean if line)


def model_message(answer: str) -> Message:
    """Return a turn of the model; an empty one is refused by several servers."""
    return Message(speaker=Speaker.ASSISTANT, text=answer[:LONGEST_ECHO] or "(empty answer)")


def make_user_message(words: str, *, images: tuple[bytes, ...] = ()) -> Message:
    """Return a turn of whoever talks to the model."""
    return Message(speaker=Speaker.USER, text=words, images=images)


def modifier_messages(
    scene: Scene, instruction: str, options: PromptOptions | None = None
) -> Messages:
    """Ask the modifier for a change."""
    options = options or PromptOptions()
    shown = scene_text(scene, radius_m=options.radius_m, lanes=options.lanes)
    return _opening(
        _modifier(options), fill_text("task.md", scene=shown, quoted=quote(instruction))
    )


def re_ask_messages(messages: Messages, answer: str, problems: Sequence[str]) -> Messages:
    """Return the conversation so far, the modifier's unreadable answer, and its faults.

    Only an answer that holds a block is told to keep its placement.
    """
    called = any(calls_in(answer, tool) for tool in PARAMETERS)
    problem_texts = [*problems, read_text("re_ask_calls.md")] if called else problems
    keep = read_text("re_ask_keep.md") if names_changes(answer) else ""
    text = fill_text("re_ask.md", problems=_join_entries(problem_texts), keep=keep)
    return (*messages, model_message(answer), make_user_message(text))


def block_messages(messages: Messages, answer: str) -> Messages:
    """Return the conversation up to the modifier's sections, and the request for their block."""
    return (*messages, model_message(answer), make_user_message(read_text("block.md")))


def follow_up_messages(messages: Messages, instruction: str) -> Messages:
    """Return the conversation up to the modifier's last answer, and what the user wishes next."""
    return (*messages, make_user_message(fill_text("follow_up.md", quoted=quote(instruction))))


def regenerate_messages(
    messages: Messages, feedback: Sequence[str], *, is_measured: bool
) -> Messages:
    """Return the conversation so far, and what a review found about its last answer.

    Args:
        messages: Up to and including that answer.
        feedback: One entry a problem.
        is_measured: Whether these are measured facts rather than somebody's opinion.
    """
    words = fill_text(
        "measured.md" if is_measured else "feedback.md", feedback=_join_entries(feedback)
    )
    return (*messages, make_user_message(words))


def result_text(results: Sequence[str], *, is_over: bool) -> str:
    """Tell the results of calls made in the prompt, each as one line of JSON."""
    rest = read_text("calls_are_over.md" if is_over else "calls_go_on.md")
    return fill_text("function_result.md", results=_number_entries(results), rest=rest)


@cache
def list_native_tools(options: PromptOptions) -> tuple[Tool, ...]:
    """Return the function as endpoints with native calls are told of it, none to others."""
    if not options.is_native:
        return ()
    return (Tool(**json.loads(read_text(f"{options.tools}.json"))["function"]),)


def review_messages(
    role: str,
    scene: Scene,
    instruction: str,
    modification: Modification,
    *,
    radius_m: float,
    earlier: Sequence[str] = (),
    refusal: str = "",
) -> Messages:
    """Ask the reviewer for ratings, or the engineer for questions to the viewer.

    Both see scene, wish and changed vectors, no reasoning but that of a refusal.

    Args:
        role: Which of the two.
        scene: The scene before the change.
        instruction: The user's wish.
        modification: What is reviewed.
        radius_m: How far around the ego the scene is written down.
        earlier: The feedback that the editor was given in earlier rounds.
        refusal: Why the editor changes nothing, where it said so.
    """
    system = fill_text(
        f"{role}.md",
        input_format=_input_format(radius_m),
        distances=read_text("distances_walked.md"),
        rules=read_text("rules.md"),
        refusal=fill_text("refusal_reviewed.md", refusal=read_text("refusal.md")),
        tolerances=_tolerances(),
        problems=read_text("common_problems.md"),
        drawn=read_text("drawn.md"),
    )
    quoted, changes = quote("\n".join(earlier)), changes_text(scene, modification)
    if refusal:
        changes += "\n\n" + fill_text("refusal_reason.md", quoted=quote(refusal)).strip()
    task = fill_text(
        "review_task.md",
        scene=scene_text(scene, radius_m=radius_m),
        quoted=quote(instruction),
        changes=changes,
        earlier=fill_text("earlier_feedback.md", quoted=quoted) if earlier else "",
    )
    return _opening(system, task)


def viewer_messages(questions: Sequence[str], pictures: Sequence[bytes]) -> Messages:
    """Ask the viewer the questions about the pictures (PNG)."""
    lines = _number_entries([" ".join(question.split()) for question in questions])
    system = fill_text("viewer.md", drawn=read_text("drawn.md"))
    return _opening(system, fill_text("viewer_task.md", questions=lines), tuple(pictures))


def verdict_messages(
    messages: Messages, questions: Sequence[str], answers: Mapping[int, str]
) -> Messages:
    """Return the engineer's conversation up to his questions, and what the viewer saw."""
    lines = [
        f"{' '.join(question.split())} -> {answers.get(number, CANNOT_SEE)}"
        for number, question in enumerate(questions, start=1)
    ]
    text = fill_text("engineer_answers.md", answers=quote(_number_entries(lines)))
    return (*messages, make_user_message(text))


def review_re_ask_messages(
    messages: Messages, answer: str, problems: Sequence[str], *, text: str = "review_re_ask.md"
) -> Messages:
    """Return the conversation so far, a reviewer's unreadable answer, and its faults."""
    question = fill_text(text, problems=_join_entries(problems))
    return (*messages, model_message(answer), make_user_message(question))


def reader_messages(instruction: str) -> Messages:
    """Ask the intent reader: the rules with the JSON schema, and the sentence."""
    task = fill_text("reader_task.md", quoted=quote(instruction))
    schema = json.dumps(parts_schema(), separators=(",", ":"))
    return _opening(fill_text("reader.md", schema=schema), task)


def judge_messages(
    question: JudgeQuestion, instruction: str, pictures: tuple[Shown, Shown]
) -> Messages:
    """Ask a judge which of two pictures (A first) is better; nothing says who made them."""
    system = fill_text("judge.md", question=read_text(f"judge_{question}.md"))
    task = fill_text("judge_task.md", quoted=quote(instruction))
    images = [(name, png) for name, shown in zip("AB", pictures, strict=True) for png in shown]
    if len(images) > len(pictures):
        names = [f"{n}. picture {name}" for n, (name, _) in enumerate(images, start=1)]
        task += "\n\n" + fill_text("judge_frames.md", images="\n".join(names))
    return _opening(system, task, tuple(png for _, png in images))


# Private


def _opening(system: str, task: str, images: tuple[bytes, ...] = ()) -> Messages:
    return Message(speaker=Speaker.SYSTEM, text=system), make_user_message(task, images=images)


@cache
def _modifier(options: PromptOptions) -> str:
    tools, manner, work = "", "walked", "walked"
    if options.tools is not Tools.NONE:
        way = "native" if options.is_native else "in_prompt"
        manner, work = "called", f"{options.tools}_{way}"
        tools = fill_text(
            f"calls_{way}.md",
            function=read_text(f"{options.tools}.md"),
            example=read_text(f"{options.tools}_call.md"),
            calls=str(options.calls),
            identical=str(options.identical),
        )
    return fill_text(
        "modifier.md",
        input_format=_input_format(options.radius_m, options.lanes),
        distances=read_text(f"distances_{manner}.md"),
        rules=read_text("rules.md"),
        refusal=read_text("refusal.md"),
        tools=tools,
        calculations=read_text(f"calculations_{manner}.md"),
        example=read_text(f"example_{options.lanes}.md"),
        work=read_text(f"work_{work}.md"),
    )


def _input_format(radius_m: float, lanes: LaneFormat = LaneFormat.POLYLINE) -> str:
    """Tell how a scene is written down, and which part of it."""
    return fill_text(
        "input_format.md",
        coordinates=read_text(f"lanes_{lanes}.md"),
        radius_m=f"{radius_m:g}",
        behind_m=f"{behind_m(radius_m):g}",
        beside_m=f"{BESIDE_M:g}",
        crossed_m=f"{CROSSED_M:g}",
    )


def _tolerances() -> str:
    """Tell what is a deviation from the wish."""
    numbers = {name: f"{value:g}" for name, value in asdict(USUAL).items()}
    shares = {"distance": USUAL.distance_share, "spacing": USUAL.spacing_share}
    percent = {f"{name}_percent": f"{100.0 * share:g}" for name, share in shares.items()}
    return fill_text("tolerances.md", **numbers, **percent)


def _join_entries(entries: Sequence[str]) -> str:
    return "\n".join(f"- {entry}" for entry in entries)


def _number_entries(entries: Sequence[str]) -> str:
    return "\n".join(f"{number}. {entry}" for number, entry in enumerate(entries, start=1))
