"""What reviewers are told: the text reviewer, the engineer and the viewer.

They get the scene as polylines whatever the modifier got: they have no tool to walk along curves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from augment.llm.messages import Message, Speaker
from augment.prompts.fill import input_format
from augment.prompts.texts import (
    fill_text,
    model_message,
    number_lines,
    quote,
    read_text,
    said_by_user,
)
from augment.prompts.vectors import changes_text, scene_text
from augment.scene.entities import Scene
from augment.scene.modification import Modification

CANNOT_SEE = "cannot see"


def reviewer_messages(
    scene: Scene, instruction: str, modification: Modification, *, radius_m: float
) -> tuple[Message, ...]:
    """What the text reviewer is asked: scene, wish and changed vectors, no reasoning."""
    told = fill_text(
        "reviewer.md", input_format=input_format(), problems=read_text("common_problems.md")
    )
    task = _task(scene, instruction, modification, radius_m)
    return Message(speaker=Speaker.SYSTEM, text=told), said_by_user(task)


def engineer_messages(
    scene: Scene, instruction: str, modification: Modification, *, radius_m: float
) -> tuple[Message, ...]:
    """What the engineer is asked first: for questions to the viewer."""
    told = fill_text("engineer.md", input_format=input_format())
    task = _task(scene, instruction, modification, radius_m)
    return Message(speaker=Speaker.SYSTEM, text=told), said_by_user(task)


def viewer_messages(questions: Sequence[str], png: bytes) -> tuple[Message, ...]:
    """What the viewer is asked: the questions, about one picture."""
    task = fill_text("viewer_task.md", questions=number_lines(questions))
    return (
        Message(speaker=Speaker.SYSTEM, text=read_text("viewer.md")),
        said_by_user(task, images=(png,)),
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


def _task(scene: Scene, instruction: str, modification: Modification, radius_m: float) -> str:
    return fill_text(
        "review_task.md",
        scene=scene_text(scene, radius_m=radius_m),
        quoted=quote(instruction),
        changes=changes_text(scene, modification),
    )
