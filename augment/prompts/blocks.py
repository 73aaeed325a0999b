"""The JSON block that counts in a model's answer: found, read strictly, mended very little.

Whatever the text, nothing but ReplyUnreadable comes out of here, and nothing is evaluated.
"""

import json
import re
from collections.abc import Callable
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from augment.errors import ReplyUnreadable
from augment.llm.vendors import says

LONGEST_ANSWER = 200_000
"""Characters; a longer answer is not looked at."""
LONGEST_VALUE = 4_000
"""Characters that one value within a text may run over."""

_LONGEST_REFUSAL = 2_000
_NOTHING = re.compile(
    r"(?:\A|^[ \t#*_]*Modified Vectors[ \t#*_]*:)[\s*`]*(?:json\s*)?"
    r"(?:none|null|nothing|n/a|\{\s*\}|\[\s*\])[\s.*`]*\Z",
    re.IGNORECASE | re.MULTILINE,
)
_CHANGES = re.compile(r"""["'](?:add|move|remove)["']\s*:""")
_FENCE = re.compile(r"^[ \t]*```[^\n`]*\n(.*?)(?:^[ \t]*```|\Z)", re.DOTALL | re.MULTILINE)
# Each of the pieces matches wherever it begins, closed or not: the time that a hostile answer
# takes grows no faster than its length.
_STRING = r'"[^"\\\n]*(?:\\.[^"\\\n]*)*"?'
_STRING_OR_COMMENT = re.compile(rf"({_STRING})|(?://|#)[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_STRING_OR_COMMA = re.compile(rf"({_STRING})|,(?=\s*[}}\]])", re.DOTALL)
_THOUGHTS_BEGIN = re.compile(
    r"\s*(?:<(?:seed:)?(?:think|thinking|thought|reasoning)>|\[THINK\]|◁think▷"
    r"|<\|(?:start|begin)_(?:of_)?(?:thinking|thought)\|>|<\|channel\|?>(?:analysis|thought))",
    re.IGNORECASE,
)
_THOUGHTS_END = re.compile(
    r"</(?:seed:)?(?:think|thinking|thought|reasoning)\s*>|\[/THINK\]|◁/think▷"
    r"|<\|end_(?:of_)?(?:thinking|thought)\|>|<channel\|>"
    r"|<\|channel\|>final\s*(?:<\|constrain\|>\w+)?<\|message\|>",
    re.IGNORECASE,
)
# Of an answer that is a document of its own: its end passes for a block without a word.
_WRAPPER = re.compile(r"^[ \t]*`{3,}(?:markdown|md)[ \t]*\n", re.MULTILINE | re.IGNORECASE)
_Loaded = TypeVar("_Loaded")


class Strict(BaseModel):
    """The root of what is read strictly: nothing is converted, nothing unknown let through."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


_Kind = TypeVar("_Kind", bound=Strict)


def validate(kind: type[_Kind], value: object) -> _Kind:
    """Return the document as a value of that kind.

    Raises:
        ReplyUnreadable: It is none; each sentence has a path and echoes nothing.
    """
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        faults = error.errors(include_url=False, include_input=False)[:8]
    raise ReplyUnreadable([fault_sentence(fault) for fault in faults])


def fault_sentence(fault: ErrorDetails) -> str:
    """Tell one fault of pydantic's: where it is and what is wrong, without what was written."""
    path = ".".join(ascii(part).strip("'")[:40] for part in fault["loc"])
    text = fault["msg"].removeprefix("Value error, ")
    if fault["type"] == "union_tag_invalid":
        path, text = f"{path}.kind", f"Input should be {fault['ctx']['expected_tags']}"
    if fault["type"] == "dataclass_type":
        text = "Input should be an object"
    text = text.replace("tuple", "list").replace("Tuple", "List")  # as it is in JSON
    return f"{path or 'the block'}: {text}"


def last_object(answer: str, keys: frozenset[str]) -> tuple[dict[str, object], bool]:
    """Return the last JSON object with one of the keys, and whether it was mended.

    A block that names a key but can't be read is not passed over in favour of an earlier draft:
    the draft may differ from what the model settled on.

    Raises:
        ReplyUnreadable: There is no such block, it breaks JSON, or it is only the last part of
            what several blocks ask for.
    """
    if len(answer) > LONGEST_ANSWER:
        raise ReplyUnreadable([f"the answer is longer than {LONGEST_ANSWER} characters"])
    named = re.compile("|".join(rf'"{re.escape(key)}"\s*:' for key in sorted(keys)))
    wished = re.compile(rf'"({"|".join(sorted(keys))})"\s*:\s*(?:\[\s*)?(?!null)[^\[\]\s]')
    text = _WRAPPER.sub("", without_thoughts(answer))
    # The last fence may lack its end; bare objects count where no fence holds a block.
    blocks = [match.group(1) for match in _FENCE.finditer(text)]
    blocks = blocks if any(map(named.search, blocks)) else _bare_objects(text)
    for number, block in reversed([*enumerate(blocks)]):
        if not named.search(block):
            continue
        clean = block
        try:
            value = strict_json(block)
        except ReplyUnreadable:
            clean = _mend(block)
            if clean == block:
                raise
            value = strict_json(clean)
        if isinstance(value, dict) and keys & value.keys():
            if {match[1] for match in wished.finditer(" ".join(blocks[:number]))} - value.keys():
                raise ReplyUnreadable(["there are several blocks: write all of it into one"])
            return value, clean != block
    wanted = ", ".join(f'"{key}"' for key in sorted(keys))
    other = re.compile(rf"""[{{,]\s*'?(?:{"|".join(sorted(keys))})'?\s*:""")
    if any(map(other.search, blocks)):
        problem = (
            f"the block with the keys {wanted} is not JSON: keys and texts stand in double quotes"
        )
        raise ReplyUnreadable([problem])
    raise ReplyUnreadable([f"there is no fenced JSON block with the keys {wanted}"])


def strict_json(written: str) -> object:
    """Return the one JSON value in that text.

    Raises:
        ReplyUnreadable: It is none, or has a key twice or a number that JSON does not know.
    """
    return _loading(lambda: _DECODER.decode(written))


def strict_json_at(text: str, start: int) -> tuple[object, int]:
    """Return the JSON value that begins there, and where it ends.

    Raises:
        ReplyUnreadable: There is none; lines and columns are counted from there.
    """
    piece = text[start : start + LONGEST_VALUE]
    value, length = _loading(lambda: _DECODER.raw_decode(piece))
    return value, start + length


def names_changes(answer: str) -> bool:
    """Return whether the answer holds a key of a block of changes, however broken the block is."""
    return _CHANGES.search(answer) is not None


def refuses(answer: str) -> bool:
    """Return whether a modifier's answer without a block is a refusal.

    It says so in prose, or holds nothing where the block belongs.
    """
    text = without_thoughts(answer).strip()
    rest = _NOTHING.sub("", text)
    is_short = len(text) <= _LONGEST_REFUSAL
    is_refusal = is_short and (says("declines", text) or says("unmet", text))
    says_so = is_refusal and not says("placed", text)
    return "{" not in rest.replace("{}", "") and (rest != text or says_so)


def only_thinks(answer: str) -> bool:
    """Return whether the answer holds thoughts that have no end."""
    return _THOUGHTS_BEGIN.match(without_thoughts(answer)) is not None


def without_thoughts(answer: str) -> str:
    """Return the text after the last reasoning tag of models that think aloud."""
    return _THOUGHTS_END.split(answer)[-1]


def without_nulls(value: object, depth: int = 8) -> object:
    """Return a part of an answer without its nulls, for what is null is absent, to a depth."""
    if isinstance(value, list) and depth:
        return [without_nulls(part, depth - 1) for part in value]
    if isinstance(value, dict) and depth:
        return {k: without_nulls(v, depth - 1) for k, v in value.items() if v is not None}
    return value


# Private


def _bare_objects(answer: str) -> list[str]:
    """Return outermost {...}, braces in strings not counted; an open one runs to the end."""
    objects, depth, start, in_string, escaped = [], 0, 0, False, False
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
                objects.append(answer[start : index + 1])
    return [*objects, answer[start:]] if depth else objects


def _mend(block: str) -> str:
    """Return it without comments and trailing commas, which cannot shift a number."""
    for noise in (_STRING_OR_COMMENT, _STRING_OR_COMMA):
        block = noise.sub(lambda match: match.group(1) or "", block)
    return block


def _loading(load: Callable[[], _Loaded]) -> _Loaded:
    try:
        return load()
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        problem = f"the JSON block breaks at {place}: {error.msg}"
    except RecursionError:
        problem = "the JSON block is nested too deeply"
    except ValueError:
        problem = "the JSON block has a number with too many digits"
    raise ReplyUnreadable([problem])


def _refuse(constant: str) -> object:
    raise ReplyUnreadable([f"{constant} is not a number that a block may hold"])


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    fields: dict[str, object] = {}
    for key, value in pairs:
        if key in fields:
            raise ReplyUnreadable([f"the key {key[:40]!a} stands twice in one object"])
        fields[key] = value
    return fields


_DECODER = json.JSONDecoder(parse_constant=_refuse, object_pairs_hook=_once)
