"""Tiny questions that show what an endpoint can do. Pure: what to ask, and how to judge it.

None of them can be answered well by chance, or by a server that drops what it does not know.
"""

import base64
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from augment.llm.messages import Message, Reply, Request, Speaker, Tool

MARKER = "heron-4417"
LONG_LINES = 310
MAX_TOKENS = 1024
"""Room for a model that thinks before it answers."""
LIMIT_TOKENS = 16
"""The limit of an answer that would be much longer."""

# Green on the left, yellow on the right, 96 x 96 pixels.
_TWO_HALVES = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAGAAAABgCAIAAABt+uBvAAAAvklEQVR4nO3QMQ3AMAAEsUAv82Qvgb/BkhH4nO+k"
    "3NuyHxEkSJCgkPmIIEGCBIXsRwQJEiQoZD4iSJAgQSH7EUGCBAkKmY8IEiRIUMh+RJAgQYJC5iOCBAkSFLIfESRI"
    "kKCQ+YggQYIEhexHBAkSJChkPiJIkCBBIfsRQYIECQqZjwgSJEhQyH5EkCBBgkLmI4IECRIUsh8RJEiQoJD5iCBB"
    "ggSF7EcECRIkKGQ+IkiQIEEh+xFBggQJCpmP/DzArd6VCqDv6wAAAABJRU5ErkJggg=="
)


class Ability(StrEnum):
    """Ability that a probe asks about."""

    ANSWERS = "answers"
    ANSWER_LIMIT = "answer_limit"
    TEMPERATURE = "temperature"
    NATIVE_TOOLS = "native_tools"
    SCHEMA = "schema"
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


def questions_for(
    model: str, chosen: Sequence[Mapping[str, Any]] = ()
) -> tuple[ProbeQuestion, ...]:
    """Return the questions in order; the first decides about the rest.

    Args:
        model: The model id.
        chosen: Values of temperature, seed and reasoning effort that it will be sent.
    """

    def question(
        ability: Ability,
        text: str,
        is_good: Callable[[Reply], bool | None],
        parameter: str = "",
        images: tuple[bytes, ...] = (),
        **changes: Any,
    ) -> ProbeQuestion:
        message = Message(speaker=Speaker.USER, text=text, images=images)
        request = Request(
            model=model, messages=(message,), **({"max_tokens": MAX_TOKENS} | changes)
        )
        return ProbeQuestion(
            ability=ability, request=request, is_good=is_good, parameter=parameter
        )

    ready, steady = ("Answer with the single word: " + word for word in ("ready", "steady"))
    story = "Write a story of five hundred words about a car."
    twice = "Use the function to double the number 21."
    sentence = "Write a sentence about a car that stands in the sun."
    halves = "Name the colour of the left half of the picture, then that of the right half."
    steadily: list[Mapping[str, Any]] = [{"temperature": 0.0, "seed": 1}, *chosen]
    return (
        question(Ability.ANSWERS, ready, _says("ready")),
        question(Ability.ANSWER_LIMIT, story, _keeps_limit, max_tokens=LIMIT_TOKENS),
        *(
            question(Ability.TEMPERATURE, steady, _says("steady"), "temperature", **values)
            for values in steadily
        ),
        question(Ability.NATIVE_TOOLS, twice, _calls_double, "tools", tools=(_DOUBLE,)),
        question(Ability.SCHEMA, sentence, _obeys_schema, schema=_PLATE),
        question(Ability.VISION, halves, _sees_both_halves, images=(_TWO_HALVES,)),
        question(Ability.WHOLE_PROMPT, _long_text(), _says(MARKER)),
    )


# Private


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


_PLATE: dict[str, object] = {
    "type": "object",
    "properties": {"plate": {"type": "string", "enum": [MARKER]}, "doors": {"type": "integer"}},
    "required": ["plate", "doors"],
    "additionalProperties": False,
}


def _obeys_schema(reply: Reply) -> bool:
    try:
        answer = json.loads(reply.text)
    except ValueError:
        return False
    keys = {"plate": MARKER, "doors": answer.get("doors")} if isinstance(answer, dict) else None
    return answer == keys and type(answer["doors"]) is int


def _says(word: str) -> Callable[[Reply], bool]:
    return lambda reply: word in reply.text.lower()


def _calls_double(reply: Reply) -> bool:
    return any(call.name == _DOUBLE.name for call in reply.tool_calls)


def _keeps_limit(reply: Reply) -> bool | None:
    """Allow twice the limit: servers count the end of an answer differently."""
    written = reply.completion_tokens
    if written is None:
        return None
    if written > 2 * LIMIT_TOKENS:
        return False
    return True if reply.is_cut_off or written >= LIMIT_TOKENS else None


def _sees_both_halves(reply: Reply) -> bool:
    answer = reply.text.lower()
    return 0 <= answer.find("green") < answer.find("yellow")


def _long_text() -> str:
    """Return a word to remember, some 6,000 tokens of nothing, and the question for the word."""
    lines = [f"The word to remember is {MARKER}.", "What follows is of no importance."]
    lines += [
        f"Line {number}: a car of {number % 7 + 3}.{number % 10} m stands {number * 13 % 97} m "
        "ahead, nobody minds it."
        for number in range(LONG_LINES)
    ]
    lines.append("Which word were you told to remember at the very start? Answer with it alone.")
    return "\n".join(lines)
