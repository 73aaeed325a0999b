"""What reviewers are told: the text reviewer, the engineer and the viewer.

They get the scene as polylines whatever the modifier got: they have no tool to walk along curves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from augment.checks.parties import USUAL, Tolerances
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
from augment.scene.entities import Modification, Scene

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
