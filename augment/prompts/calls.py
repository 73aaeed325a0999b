"""Calls of a tool that a model wrote into its answer: lines that are exactly one JSON object.

Whatever the text, nothing is raised: a call that can't be read is a call with a problem, which
goes back to the model. An answer with a call is no final answer, whatever else stands in it: that
was written without the result.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from augment.errors import ReplyUnreadable
from augment.prompts.blocks import FENCE, LONGEST_ANSWER, strict_json, without_thoughts

_BEGINS = re.compile(r'\{\s*"call"\s*:')
_FORM = '{"call": "pose_on_lane", "arguments": {...}}'


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenCall:
    """One call as it was written.

    Attributes:
        name: Of the tool, empty where it can't be read.
        arguments: Read from JSON, None where they can't be.
        problem: What is wrong with the call itself, empty where nothing is.
    """

    name: str = ""
    arguments: object = None
    problem: str = ""


def calls_in(answer: str) -> tuple[WrittenCall, ...]:
    """The calls of an answer in order; thoughts of models that think aloud hold none."""
    if len(answer) > LONGEST_ANSWER:
        return ()
    lines = FENCE.sub(_on_one_line, without_thoughts(answer)).splitlines()
    bare = (line.strip().strip("`").strip() for line in lines)
    return tuple(_call(line) for line in bare if _BEGINS.match(line))


def read_arguments(written: str) -> WrittenCall:
    """The arguments of a native call, a JSON text of their own."""
    try:
        return WrittenCall(arguments=strict_json(written))
    except ReplyUnreadable as broken:
        return WrittenCall(problem=f"the arguments are not JSON: {broken.problems[0]}")


def _on_one_line(fence: re.Match[str]) -> str:
    """A fenced call that runs over several lines on one; every other block as it was."""
    body = fence.group(1).strip()
    if not _BEGINS.match(body) or "\n" not in body:
        return fence.group(0)
    try:
        strict_json(body)
    except ReplyUnreadable:
        return fence.group(0)
    return "\n" + " ".join(body.split("\n")) + "\n"


def _call(line: str) -> WrittenCall:
    try:
        found = strict_json(line)
    except ReplyUnreadable as broken:
        reason = broken.problems[0].replace("the JSON block", "the line")
        return WrittenCall(problem=f"a call is one line of the form {_FORM}; {reason}")
    if not isinstance(found, dict) or found.keys() != {"call", "arguments"}:
        return WrittenCall(problem=f"a call has the form {_FORM} and no other keys")
    if not isinstance(found["call"], str):
        return WrittenCall(problem=f"a call has the form {_FORM}")
    return WrittenCall(name=found["call"], arguments=found["arguments"])
