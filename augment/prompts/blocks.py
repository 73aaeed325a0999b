"""The JSON block that counts in a model's answer: found, read strictly, mended very little.

Whatever the text, nothing but ReplyUnreadable comes out of here, and nothing is evaluated.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from augment.errors import ReplyUnreadable
from augment.prompts.calls import LONGEST_VALUE

_Loaded = TypeVar("_Loaded")

LONGEST_ANSWER = 200_000
"""Characters; a longer answer is not looked at."""

_CHANGES = re.compile(r"""["'](?:add|move|remove)["']\s*:""")

FENCE = re.compile(r"^[ \t]*```[^\n`]*\n(.*?)(?:^[ \t]*```|\Z)", re.DOTALL | re.MULTILINE)


def last_object(answer: str, keys: frozenset[str]) -> tuple[dict[str, object], bool]:
    """The last JSON object of the answer that has one of the keys, and whether it was mended.

    A block that names a key but can't be read is not passed over in favour of an earlier draft:
    the draft may differ from what the model settled on.

    Raises:
        ReplyUnreadable: There is no such block, or it breaks JSON.
    """
    if len(answer) > LONGEST_ANSWER:
        raise ReplyUnreadable([f"the answer is longer than {LONGEST_ANSWER} characters"])
    named = re.compile("|".join(rf'"{re.escape(key)}"\s*:' for key in sorted(keys)))
    for block in _candidates(without_thoughts(answer)):
        if not named.search(block):
            continue
        found, mended = _loaded(block)
        if isinstance(found, dict) and keys & found.keys():
            return found, mended
    wanted = ", ".join(f'"{key}"' for key in sorted(keys))
    raise ReplyUnreadable([f"there is no fenced JSON block with the keys {wanted}"])


def strict_json(written: str) -> object:
    """The one JSON value in that text, as strictly read as a block.

    Raises:
        ReplyUnreadable: It is none.
    """
    try:
        return _strict(written)
    except _Broken as broken:
        raise ReplyUnreadable([str(broken)]) from None


def strict_json_at(text: str, start: int) -> tuple[object, int]:
    """The JSON value that begins there, strictly read, and where it ends.

    Raises:
        ReplyUnreadable: There is none; lines and columns are counted from there.
    """
    piece = text[start : start + LONGEST_VALUE]
    try:
        found, length = _loading(lambda: _DECODER.raw_decode(piece))
    except _Broken as broken:
        raise ReplyUnreadable([str(broken)]) from None
    return found, start + length


def names_changes(answer: str) -> bool:
    """Whether the answer holds a key of a block of changes, however broken the block is."""
    return _CHANGES.search(answer) is not None


def without_thoughts(answer: str) -> str:
    """What follows the last reasoning tag of models that think aloud."""
    return answer.rpartition("</think>")[2]


def _candidates(answer: str) -> list[str]:
    """Fenced blocks (the last may lack its end), last first; without any, bare objects."""
    fenced = [match.group(1) for match in FENCE.finditer(answer)]
    return (fenced or _bare_objects(answer))[::-1]


def _bare_objects(answer: str) -> list[str]:
    """Outermost {...}, braces in strings not counted; one that never closes runs to the end."""
    found, depth, start, in_string, escaped = [], 0, 0, False, False
    for index, character in enumerate(answer):
        if in_string:
            in_string = escaped or character != '"'
            escaped = not escaped and character == "\\"
        elif character == '"' and depth:
            in_string = True
        elif character == "{":
            start = start if depth else index
            depth += 1
        elif character == "}" and depth:
            depth -= 1
            if not depth:
                found.append(answer[start : index + 1])
    return [*found, answer[start:]] if depth else found


def _loaded(block: str) -> tuple[object, bool]:
    try:
        return _strict(block), False
    except _Broken as broken:
        mended = _mended(block)
        if mended == block:
            raise ReplyUnreadable([str(broken)]) from None
    try:
        return _strict(mended), True
    except _Broken as broken:
        raise ReplyUnreadable([str(broken)]) from None


class _Broken(Exception):
    """The block is not strict JSON; the text says where."""


def _strict(block: str) -> object:
    return _loading(lambda: _DECODER.decode(block))


def _loading(load: Callable[[], _Loaded]) -> _Loaded:
    try:
        return load()
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise _Broken(f"the JSON block breaks at {place}: {error.msg}") from None
    except RecursionError:
        raise _Broken("the JSON block is nested too deeply") from None
    except ValueError:
        raise _Broken("the JSON block has a number with too many digits") from None


def _refuse(constant: str) -> object:
    raise _Broken(f"{constant} is not a number that a block may hold")


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    fields: dict[str, object] = {}
    for key, value in pairs:
        if key in fields:
            raise _Broken(f"the key {key[:40]!a} stands twice in one object")
        fields[key] = value
    return fields


_DECODER = json.JSONDecoder(parse_constant=_refuse, object_pairs_hook=_once)

# Each of the pieces matches wherever it begins, closed or not: the time that a hostile answer
# takes grows no faster than its length.
_STRING = r'"[^"\\\n]*(?:\\.[^"\\\n]*)*"?'
_STRING_OR_COMMENT = re.compile(rf"({_STRING})|//[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_STRING_OR_COMMA = re.compile(rf"({_STRING})|,(?=\s*[}}\]])", re.DOTALL)


def _mended(block: str) -> str:
    """Without comments and trailing commas: what models add and what cannot shift a number."""
    for noise in (_STRING_OR_COMMENT, _STRING_OR_COMMA):
        block = noise.sub(lambda match: match.group(1) or "", block)
    return block


class Strict(BaseModel):
    """The root of what is read from answers."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


_Kind = TypeVar("_Kind", bound=Strict)


def validate(kind: type[_Kind], found: object) -> _Kind:
    """What was found, as a value of that kind.

    Raises:
        ReplyUnreadable: It is none; each sentence has a path and echoes nothing.
    """
    try:
        return kind.model_validate(found)
    except ValidationError as error:
        raise ReplyUnreadable(_sentences(error)) from None


def _sentences(error: ValidationError) -> list[str]:
    """What pydantic found, each with its path and without echoing what the model wrote."""
    sentences = []
    for fault in error.errors(include_url=False, include_input=False, include_context=False)[:8]:
        path = ".".join(ascii(part).strip("'")[:40] for part in fault["loc"]) or "the block"
        sentences.append(f"{path}: {fault['msg']}")
    return sentences
