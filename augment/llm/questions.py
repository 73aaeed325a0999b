"""Tiny questions that show what an endpoint can do. Pure: what to ask, and how to judge it.

None of them can be answered well by chance, or by a server that drops what it does not know.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from augment.llm.messages import AnswerSchema, Message, Reply, Request, Speaker, Tool

MARKER = "heron-4417"
LONG_LINES = 310
MAX_TOKENS = 1024
"""Room for a model that thinks before it answers."""
LIMIT_TOKENS = 16
"""The limit of an answer that would be much longer."""

_SIDE_PX = 96
_GREEN, _YELLOW = (0, 128, 0), (255, 255, 0)


class Ability(StrEnum):
    """What is asked about."""

    ANSWERS = "answers"
    ANSWER_LIMIT = "answer_limit"
    TEMPERATURE = "temperature"
    JSON_SCHEMA = "json_schema"
    NATIVE_TOOLS = "native_tools"
    VISION = "vision"
    WHOLE_PROMPT = "whole_prompt"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeQuestion:
    """One request, and what a good answer to it is.

    Attributes:
        is_good: None where the answer does not tell.
        parameter: The wire's name of what the endpoint may refuse, empty where there is none.
    """

    ability: Ability
    request: Request
    is_good: Callable[[Reply], bool | None]
    parameter: str = ""


def questions_for(model: str) -> tuple[ProbeQuestion, ...]:
    """The questions in the order in which they are asked; the first decides about the others."""
    return (
        _question(model, Ability.ANSWERS, "Answer with the single word: ready", _says("ready")),
        _question(
            model,
            Ability.ANSWER_LIMIT,
            "Write a story of five hundred words about a car.",
            _keeps_limit,
            max_tokens=LIMIT_TOKENS,
        ),
        _question(
            model,
            Ability.TEMPERATURE,
            "Answer with the single word: steady",
            _says("steady"),
            parameter="temperature",
            temperature=0.0,
            seed=1,
        ),
        _question(
            model,
            Ability.JSON_SCHEMA,
            "How much is 19 and 23 together?",
            _is_sum,
            parameter="response_format",
            answer_schema=_SUM,
        ),
        _question(
            model,
            Ability.NATIVE_TOOLS,
            "Use the function to double the number 21.",
            lambda reply: any(call.name == _DOUBLE.name for call in reply.tool_calls),
            parameter="tools",
            tools=(_DOUBLE,),
        ),
        _question(
            model,
            Ability.VISION,
            "Name the colour of the left half of the picture, then that of the right half.",
            _sees_both_halves,
            images=(two_halves(),),
        ),
        _question(model, Ability.WHOLE_PROMPT, _long_text(), _says(MARKER)),
    )


def two_halves() -> bytes:
    """A PNG that is green on the left and yellow on the right."""
    half = _SIDE_PX // 2
    row = b"\0" + bytes(_GREEN) * half + bytes(_YELLOW) * half
    header = struct.pack(">IIBBBBB", _SIDE_PX, _SIDE_PX, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(row * _SIDE_PX)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


# --- Private -----------------------------------------------------------------------------------

_SUM = AnswerSchema(
    name="sum",
    schema={
        "type": "object",
        "properties": {"sum": {"type": "integer"}},
        "required": ["sum"],
        "additionalProperties": False,
    },
)
_DOUBLE = Tool(
    name="double",
    description="Doubles a whole number.",
    parameters={
        "type": "object",
        "properties": {"number": {"type": "integer"}},
        "required": ["number"],
        "additionalProperties": False,
    },
)


def _question(
    model: str,
    ability: Ability,
    text: str,
    is_good: Callable[[Reply], bool | None],
    *,
    parameter: str = "",
    images: tuple[bytes, ...] = (),
    max_tokens: int = MAX_TOKENS,
    **changes: object,
) -> ProbeQuestion:
    message = Message(speaker=Speaker.USER, text=text, images=images)
    request = Request(model=model, messages=(message,), max_tokens=max_tokens, **changes)  # type: ignore[arg-type]
    return ProbeQuestion(ability=ability, request=request, is_good=is_good, parameter=parameter)


def _says(word: str) -> Callable[[Reply], bool]:
    return lambda reply: word in reply.text.lower()


def _keeps_limit(reply: Reply) -> bool | None:
    """Twice the limit is allowed: servers count the end of an answer differently."""
    written = reply.completion_tokens
    if written is None:
        return None
    if written > 2 * LIMIT_TOKENS:
        return False
    return True if reply.finish_reason == "length" or written >= LIMIT_TOKENS else None


def _is_sum(reply: Reply) -> bool:
    try:
        return bool(json.loads(reply.text) == {"sum": 42})
    except (ValueError, RecursionError):
        return False


def _sees_both_halves(reply: Reply) -> bool:
    answer = reply.text.lower()
    return 0 <= answer.find("green") < answer.find("yellow")


def _long_text() -> str:
    """A word to remember, some 6,000 tokens of nothing, and the question for the word."""
    lines = [f"The word to remember is {MARKER}.", "What follows is of no importance."]
    lines += [
        f"Line {number}: a car of {number % 7 + 3}.{number % 10} m stands {number * 13 % 97} m "
        "ahead, nobody minds it."
        for number in range(LONG_LINES)
    ]
    lines.append("Which word were you told to remember at the very start? Answer with it alone.")
    return "\n".join(lines)


def _chunk(kind: bytes, data: bytes) -> bytes:
    checksum = struct.pack(">I", zlib.crc32(kind + data))
    return struct.pack(">I", len(data)) + kind + data + checksum
