"""What the intent reader is asked, and how its answer becomes an intent.

In: an instruction. Out: messages; from a raw answer an `Intent`, or ReplyUnreadable that says
where it breaks the schema.
"""

from __future__ import annotations

import json
from functools import cache

from augment.errors import InvalidDocument, ReplyUnreadable
from augment.llm.messages import Message, Speaker
from augment.prompts.blocks import last_object
from augment.prompts.texts import fill_text, quote, said_by_user
from augment.scene.codec import intent_from_parts, parts_schema
from augment.scene.intent import Intent

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
