"""Prompt texts filled with a scene and an instruction: the only place where that happens.

The texts are package data under `text/`. What is the same for every scenario comes first, then
the scene, then the instruction, so that an endpoint can reuse the unchanged beginning.
"""

from __future__ import annotations

import hashlib
import unicodedata
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from augment.llm.messages import Message, Speaker
from augment.prompts.vectors import DEFAULT_RADIUS_M, scene_text
from augment.scene.entities import Scene

QUOTE = "> "
"""Stands before every line of the user's instruction: no line of it can end the quotation."""

_LONGEST_ECHO = 20_000


def modifier_messages(
    scene: Scene, instruction: str, *, radius_m: float = DEFAULT_RADIUS_M
) -> tuple[Message, ...]:
    """What the modifier is asked first."""
    task = _filled(
        "task.md", scene=scene_text(scene, radius_m=radius_m), quoted=quoted(instruction)
    )
    return (
        Message(speaker=Speaker.SYSTEM, text=_text("modifier.md")),
        Message(speaker=Speaker.USER, text=task),
    )


def re_ask_messages(
    messages: tuple[Message, ...], answer: str, problems: Sequence[str]
) -> tuple[Message, ...]:
    """The conversation so far, the answer that can't be read, and what is wrong with it."""
    listed = "\n".join(f"- {problem}" for problem in problems)
    # An empty turn is refused by several servers.
    said = answer[:_LONGEST_ECHO] or "(empty answer)"
    return (
        *messages,
        Message(speaker=Speaker.ASSISTANT, text=said),
        Message(speaker=Speaker.USER, text=_filled("re_ask.md", problems=listed)),
    )


def quoted(instruction: str) -> str:
    """The instruction as a quotation, line by line, without control characters."""
    clean = ("".join(map(_printable, line)).strip() for line in instruction.splitlines())
    return "\n".join(QUOTE + line for line in clean if line)


@cache
def prompt_version() -> str:
    """Twelve hexadecimal digits that change with every change to any prompt text."""
    digest = hashlib.sha256()
    for entry in sorted(files(__package__).joinpath("text").iterdir(), key=lambda e: e.name):
        digest.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


@cache
def _text(name: str) -> str:
    return files(__package__).joinpath("text", name).read_text(encoding="utf-8").strip()


def _filled(name: str, **values: str) -> str:
    """The text with each {{name}} replaced once; what is filled in is not looked at again."""
    filled = []
    rest = _text(name)
    while "{{" in rest:
        before, _, rest = rest.partition("{{")
        key, _, rest = rest.partition("}}")
        filled += [before, values[key]]
    return "".join([*filled, rest])


def _printable(character: str) -> str:
    return " " if unicodedata.category(character).startswith("C") else character
