"""What the stand-in answers to the tiny questions of a probe, from the request alone."""

from __future__ import annotations

import json
import re

from augment.fake_llm.requests import ChatRequest

WINDOW_TOKENS = 2048
"""The context window of `fake-cuts-context`."""

_KEPT_CHARACTERS = 6000
_WORD = re.compile(r"Answer with the single word: (\w+)")
_SUM = re.compile(r"How much is (\d+) and (\d+) together\?")
_DOUBLE = re.compile(r"double the number (\d+)")
_REMEMBER = re.compile(r"The word to remember is ([\w-]+)\.")


def answer_to(request: ChatRequest) -> tuple[str, tuple[tuple[str, str], ...]] | None:
    """A text and calls (name, arguments); None where the request is no question of a probe."""
    message = request.messages[-1]
    text = message.text
    if match := _WORD.fullmatch(text):
        return match.group(1), ()
    if text.startswith("Write a story"):
        return "A car stood on the road. " * 3, ()  # about as long as the limit allows
    if match := _SUM.fullmatch(text):
        total = int(match.group(1)) + int(match.group(2))
        as_object = request.response_format is not None
        return (json.dumps({"sum": total}) if as_object else f"That makes {total}."), ()
    if (match := _DOUBLE.search(text)) and request.tools:
        arguments = json.dumps({"number": int(match.group(1))})
        return "", ((request.tools[0].function.name, arguments),)
    if message.images and text.startswith("Name the colour of the left half"):
        return "The left half is green, the right half is yellow.", ()
    if text.rstrip().endswith("Answer with it alone."):
        match = _REMEMBER.search(text)
        return (match.group(1) if match else "I was told no word."), ()
    return None


def cut_to_window(request: ChatRequest) -> ChatRequest:
    """The request as a server sees it that silently drops the front of a long prompt."""
    last = request.messages[-1]
    kept = last.model_copy(update={"content": last.text[-_KEPT_CHARACTERS:]})
    return request.model_copy(update={"messages": [kept]})
