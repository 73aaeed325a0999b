"""Calls of a tool that a model wrote into its answer.

The form that was asked for is a line that is exactly one JSON object. It counts wherever it
stands: an answer with such a call is no final answer, since it was written without the result.
Models write other forms as well: within a sentence or a list, over several lines, with other
keys. These count where the answer holds no block of changes, so that nobody who tells in a final
answer what was called before is taken to call again.

Whatever the text, nothing is raised: a call that can't be read is a call with a problem, which
goes back to the model.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

from augment.errors import ReplyUnreadable
from augment.prompts import blocks


class Tools(StrEnum):
    """Functions that the modifier may call, by name: none, the paper's, or ours."""

    NONE = "none"
    RETRIEVE = "retrieve_suitable_pose"
    POSE_ON_LANE = "pose_on_lane"


PARAMETERS = {
    Tools.RETRIEVE: ("lane", "agent", "dist"),
    Tools.POSE_ON_LANE: (
        *("lane", "start", "distance_m", "lateral_m", "object"),
        *("speed_mps", "motion", "after_s"),
    ),
}
"""Of each function, in the order in which the prompt names them."""
MOST_LOOKED_AT = 64

_NAMES = ("call", "name", "function", "tool", "tool_name", "function_name")
_ARGUMENTS = ("arguments", "parameters", "args", "kwargs", "input")
_OPENING = re.compile(
    rf"""\{{\s*["'](?:{"|".join((*_NAMES, *_ARGUMENTS, *PARAMETERS))})["']\s*:"""
)
_EXACT = re.compile(r'\{\s*"call"\s*:')
_ALONE_BEHIND = re.compile(r"[ \t`]*(?:\n|\Z)")


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenCall:
    """One call as it was written.

    Attributes:
        name: Of the tool, empty where it can't be read.
        arguments: Read from JSON, None where they can't be.
        problem: What is wrong with the call itself, empty where nothing is.
        mended: Whether it was understood although it is not in the form that was asked for.
    """

    name: str = ""
    arguments: object = None
    problem: str = ""
    mended: bool = False


def call_form(tool: Tools) -> str:
    """Return the form of a call, with its arguments left out."""
    return f'{{"call": "{tool}", "arguments": {{...}}}}'


def calls_in(answer: str, tool: Tools, *, is_cut_off: bool = False) -> tuple[WrittenCall, ...]:
    """Return the calls of an answer in order; thoughts of models that think aloud hold none.

    An answer that speaks of the tool and holds neither a call nor a block of changes is a call
    with a problem.

    Args:
        answer: The raw text of the model.
        tool: The function that it was told of.
        is_cut_off: Whether it hit its length limit: the block of changes may be missing, so
            only the form that was asked for counts.
    """
    if len(answer) > blocks.LONGEST_ANSWER:
        return ()
    text = blocks.without_thoughts(answer)
    is_final = is_cut_off or blocks.names_changes(text)
    calls = tuple(_calls(text, tool, exact_alone=is_final))
    if not calls and not is_final and tool in text:
        problem = f"{tool} is named and not called; a call is one line of the form "
        problem += call_form(tool)
        return (WrittenCall(problem=problem),)
    return calls


def read_arguments(written: str) -> WrittenCall:
    """Read the arguments of a native call, a JSON text of their own."""
    if len(written) > blocks.LONGEST_ANSWER:
        return WrittenCall(
            problem=f"the arguments are longer than {blocks.LONGEST_ANSWER} characters"
        )
    try:
        return WrittenCall(arguments=blocks.strict_json(written))
    except ReplyUnreadable as broken:
        return WrittenCall(problem=f"the arguments are not JSON: {broken.problems[0]}")


# Private


def _calls(text: str, tool: Tools, *, exact_alone: bool) -> Iterator[WrittenCall]:
    """Yield each call of the text that counts."""
    end = looked_at = 0
    for opening in _OPENING.finditer(text):
        start = opening.start()
        begins_line = not text[text.rfind("\n", 0, start) + 1 : start].strip(" \t`")
        is_exact = begins_line and _EXACT.match(text, start) is not None
        if start < end or (exact_alone and not is_exact):
            continue
        looked_at += 1
        if looked_at > MOST_LOOKED_AT:
            return
        try:
            written, end = blocks.strict_json_at(text, start)
        except ReplyUnreadable as broken:
            fault = broken.problems[0].replace("the JSON block", "the line")
            yield WrittenCall(problem=f"a call is one line of the form {call_form(tool)}; {fault}")
            end = text.find("\n", start) if "\n" in text[start:] else len(text)
            continue
        if isinstance(written, dict) and (call := _parse_call(written, tool)) is not None:
            has_form = begins_line and written.keys() == {"call", "arguments"}
            is_mended = not (call.problem or (has_form and _ALONE_BEHIND.match(text, end)))
            yield replace(call, mended=is_mended)


def _parse_call(written: dict[str, object], tool: Tools) -> WrittenCall | None:
    """Return the call that an object stands for, None for anything else."""
    inner = written.get("function")
    body: dict[str, object] = inner if isinstance(inner, dict) else written
    if body.keys() == {tool}:
        return _with_arguments(tool, body[tool])
    name_key = next((key for key in _NAMES if key in body), None)
    arguments_key = next((key for key in _ARGUMENTS if key in body), None)
    name = None if name_key is None else body[name_key]
    rest = {key: value for key, value in body.items() if key not in {name_key, arguments_key}}
    if not isinstance(name, str):
        is_call = name_key == "call" or arguments_key is not None
        return WrittenCall(problem=f"a call has the form {call_form(tool)}") if is_call else None
    if arguments_key is not None and rest.keys() <= {"id", "type"}:
        return _with_arguments(name, body[arguments_key])
    if arguments_key is None and name == tool and rest.keys() & set(PARAMETERS[tool]):
        return _with_arguments(name, rest)
    if name == tool or name_key == "call":
        return WrittenCall(problem=f"a call has the form {call_form(tool)} and no other keys")
    return None


def _with_arguments(name: str, arguments: object) -> WrittenCall:
    if isinstance(arguments, str):
        return replace(read_arguments(arguments), name=name)
    return WrittenCall(name=name, arguments=arguments)
