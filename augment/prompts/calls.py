"""Calls of a tool that a model wrote into its answer.

The form that was asked for is a line that is exactly one JSON object. It counts wherever it
stands: an answer with such a call is no final answer, since it was written without the result.
Models write other forms as well: within a sentence or a list, over several lines, with other
keys, other quotes, or as Python. These count where the answer holds no block of changes, so that
nobody who tells in a final answer what was called before is taken to call again. Of Python only
literals are read and nothing is evaluated: no arithmetic, no units, no names of variables.

Whatever the text, nothing is raised: a call that can't be read is a call with a problem, which
goes back to the model.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from augment.errors import ReplyUnreadable
from augment.prompts.blocks import (
    LONGEST_ANSWER,
    LONGEST_VALUE,
    names_changes,
    strict_json,
    strict_json_at,
    without_thoughts,
)

TOOL = "pose_on_lane"
PARAMETERS = ("lane", "start", "distance_m", "lateral_m", "object")
"""In the order in which the prompt names them."""
MOST_LOOKED_AT = 64

_FORM = '{"call": "pose_on_lane", "arguments": {...}}'
_NAMES = ("call", "name", "function", "tool", "tool_name", "function_name")
_ARGUMENTS = ("arguments", "parameters", "args", "kwargs", "input")
_ASIDE = frozenset({"id", "type"})
_OBJECT = rf"""\{{\s*["'](?P<key>{"|".join((*_NAMES, *_ARGUMENTS, TOOL))})["']\s*:"""
_PYTHON = r"(?<![\w.])(?P<name>\w{0,40}?(?:pose_|_pose)\w{0,40})[ \t]{0,3}\("
_OPENING = re.compile(f"{_OBJECT}|{_PYTHON}")
_EXACT = re.compile(r'\{\s*"call"\s*:')
_ALONE_BEHIND = re.compile(r"[ \t`]*(?:\n|\Z)")
_ID = re.compile(r"[A-Z][a-z]+[0-9]+[a-z]?|lane")
_BRACKET = re.compile(r""""[^"\\\n]*(?:\\.[^"\\\n]*)*"|'[^'\\\n]*(?:\\.[^'\\\n]*)*'|[][(){}]""")
_ODD_ESCAPE = re.compile(r"""\\[^"'\\/bfnrtu]""")
_JSON_WORDS = {"true": True, "false": False, "null": None}


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


def calls_in(answer: str, *, is_cut_off: bool = False) -> tuple[WrittenCall, ...]:
    """Return the calls of an answer in order; thoughts of models that think aloud hold none.

    An answer that speaks of the tool and holds neither a call nor a block of changes is a call
    with a problem.

    Args:
        answer: The raw text of the model.
        is_cut_off: Whether it hit its length limit: the block of changes may be missing, so
            only the form that was asked for counts.
    """
    if len(answer) > LONGEST_ANSWER:
        return ()
    text = without_thoughts(answer)
    is_final = is_cut_off or names_changes(text)
    calls = tuple(_calls(text, exact_alone=is_final))
    if not calls and not is_final and TOOL in text:
        problem = f"{TOOL} is named and not called; a call is one line of the form {_FORM}"
        return (WrittenCall(problem=problem),)
    return calls


def read_arguments(written: str) -> WrittenCall:
    """Read the arguments of a native call, a JSON text of their own."""
    if len(written) > LONGEST_ANSWER:
        return WrittenCall(problem=f"the arguments are longer than {LONGEST_ANSWER} characters")
    try:
        return WrittenCall(arguments=strict_json(written))
    except ReplyUnreadable as broken:
        return WrittenCall(problem=f"the arguments are not JSON: {broken.problems[0]}")


# Private


def _calls(text: str, *, exact_alone: bool) -> Iterator[WrittenCall]:
    """Yield each call of the text that counts."""
    end = looked_at = 0
    for opening in _OPENING.finditer(text):
        start = opening.start()
        is_exact = _EXACT.match(text, start) is not None and _begins_line(text, start)
        if start < end or (exact_alone and not is_exact):
            continue
        looked_at += 1
        if looked_at > MOST_LOOKED_AT:
            return
        read = _python_call if opening["name"] is not None else _object_call
        call, end = read(text, opening)
        if call is not None:
            yield call


def _begins_line(text: str, start: int) -> bool:
    line = text.rfind("\n", 0, start) + 1
    return not text[line:start].strip(" \t`")


def _object_call(text: str, opening: re.Match[str]) -> tuple[WrittenCall | None, int]:
    """Read a call written as an object; None where it is some other object, and where it ends."""
    start, is_strict = opening.start(), True
    try:
        written, end = strict_json_at(text, start)
    except ReplyUnreadable as broken:
        is_strict = False
        end = _closing(text, start)
        try:
            written = _value(_expression(text[start:end]))
        except ValueError:
            fault = broken.problems[0].replace("the JSON block", "the line")
            problem = f"a call is one line of the form {_FORM}; {fault}"
            line_end = text.find("\n", start)
            return WrittenCall(problem=problem), len(text) if line_end < 0 else line_end
    call = _call_of(written)
    is_alone = _begins_line(text, start) and _ALONE_BEHIND.match(text, end) is not None
    has_form = isinstance(written, dict) and written.keys() == {"call", "arguments"}
    if call is None or call.problem or (is_alone and has_form and is_strict):
        return call, end
    return replace(call, mended=True), end


def _call_of(written: object) -> WrittenCall | None:
    """Return what an object calls, None where it is something else."""
    if not isinstance(written, dict):
        return None
    inner = written.get("function")
    body: dict[str, object] = inner if isinstance(inner, dict) else written
    if body.keys() == {TOOL}:
        return _with_arguments(TOOL, body[TOOL])
    name_key = next((key for key in _NAMES if key in body), None)
    arguments_key = next((key for key in _ARGUMENTS if key in body), None)
    name = None if name_key is None else body[name_key]
    rest = {key: value for key, value in body.items() if key not in {name_key, arguments_key}}
    if not isinstance(name, str):
        is_call = name_key == "call" or arguments_key is not None
        return WrittenCall(problem=f"a call has the form {_FORM}") if is_call else None
    if arguments_key is not None and rest.keys() <= _ASIDE:
        return _with_arguments(name, body[arguments_key])
    if arguments_key is None and name == TOOL and rest.keys() & set(PARAMETERS):
        return _with_arguments(name, rest)
    if name == TOOL or name_key == "call":
        return WrittenCall(problem=f"a call has the form {_FORM} and no other keys")
    return None


def _with_arguments(name: str, arguments: object) -> WrittenCall:
    if isinstance(arguments, str):
        return replace(read_arguments(arguments), name=name)
    return WrittenCall(name=name, arguments=arguments)


def _python_call(text: str, opening: re.Match[str]) -> tuple[WrittenCall | None, int]:
    """Read a call written as Python; None where the tool is only named, and where it ends."""
    start, name = opening.end(), opening["name"]
    end = _closing(text, start - 1)
    try:
        call = _expression(f"f({text[start:end]}")
        if not isinstance(call, ast.Call):
            raise ValueError("it is no call")
        placed = [_value(argument) for argument in call.args]
        named = [(one.arg, _value(one.value, bare=True)) for one in call.keywords]
    except ValueError as broken:
        if not re.match(r"[^)\n]*[=\"'0-9]", text[start : start + 200]):
            return None, start  # a signature
        return WrittenCall(problem=f"a call is one line of the form {_FORM}; {broken}"), end
    if not placed and not named:
        return None, end
    pairs = [*zip(PARAMETERS, placed, strict=False), *named]
    if len(placed) > len(PARAMETERS) or len(dict(pairs)) < len(pairs):
        return WrittenCall(problem=f"a call has the form {_FORM} and each argument once"), end
    return WrittenCall(name=name, arguments=dict(pairs), mended=True), end


def _closing(text: str, start: int) -> int:
    """Return where the bracket that opens there is closed, or the end of what is looked at."""
    depth = 0
    for bracket in _BRACKET.finditer(text, start, start + LONGEST_VALUE):
        if bracket.group() in "([{":
            depth += 1
        elif bracket.group() in ")]}":
            depth -= 1
            if depth == 0:
                return bracket.end()
    return start + 1


def _expression(written: str) -> ast.expr:
    """Parse a Python expression.

    Raises:
        ValueError: It is none.
    """
    # Python warns of escapes that it does not know, and reads some that JSON does not.
    if _ODD_ESCAPE.search(written):
        raise ValueError("it has an escape that JSON does not know")
    try:
        return ast.parse(written, mode="eval").body
    except SyntaxError as error:
        raise ValueError(f"it breaks: {error.msg}") from None
    except (ValueError, RecursionError, MemoryError):
        raise ValueError("it is nested too deeply or holds odd characters") from None


def _value(node: ast.expr, *, bare: bool = False) -> object:
    """Return what a literal stands for; ids may lack their quotes where `bare`.

    Raises:
        ValueError: It is none.
    """
    match node:
        case ast.Constant(value=None | bool() | int() | float() | str() as value):
            return value
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
            return -number
        case ast.UnaryOp(op=ast.UAdd(), operand=ast.Constant(value=int() | float() as number)):
            return number
        case ast.Name(id=name) if name in _JSON_WORDS:
            return _JSON_WORDS[name]
        case ast.Name(id=name) if bare and _ID.fullmatch(name):
            return name
        case ast.List(elts=entries):
            return [_value(entry) for entry in entries]
        case ast.Dict(keys=keys, values=values):
            names = [key.value for key in keys if isinstance(key, ast.Constant)]
            if len(set(names)) == len(keys) and all(isinstance(key, str) for key in names):
                return dict(zip(names, map(_value, values), strict=True))
    raise ValueError(f"{type(node).__name__} is no value")
